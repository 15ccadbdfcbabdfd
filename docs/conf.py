"""The site: ``sphinx-build -W docs docs/_build``. It needs no network."""

import os
import sys
from pathlib import Path

import alignscores

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

os.environ["COLUMNS"] = "88"  # argparse breaks its lines there, whatever the terminal

project = "alignscores"
author = "The alignscores contributors"
version = release = alignscores.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinxarg.ext",
    # Of this folder's _extensions:
    "columns",
    "notebooks",
    "statements",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]
nitpicky = True  # a name that leads nowhere is an error
nitpick_ignore_regex = [  # what docstrings name and no page shows
    ("py:obj", r"(alignscores\.(registration|io)|studies)\..*|PROTOCOLS"),
    ("py:.*", r"(numpy|scipy|builtins)\..*|array_like|callable"),
]
default_role = "autolink"  # `name` in a docstring

# Pages are read in the repository, too: headings have the anchors that they have there.
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4

autodoc_typehints = "none"  # the sections of the docstrings have the types
numpydoc_show_class_members = False
numpydoc_validation_checks = {
    "EX01",  # an example
    "GL08",  # a docstring at all
    "PR01",  # all parameters, and no others, in their order, with types and descriptions
    "PR02",
    "PR03",
    "PR04",
    "PR07",
    "RT01",  # what is returned, with a description
    "RT03",
    "SS01",  # a summary
}

numpydoc_validation_exclude = {
    r"\.evo\.[A-Z]+\.",  # methods of evo
    r"\.Registration$",  # a signature
    r"(NoValueError|Warning)$",
    # Properties and short methods, which one line describes; the class has examples.
    r"\.(Comparison|Evaluation|Matches|Settings|Trajectory)\.(?!plot|save_|to_|value|verdict|with_)",
    r"\.(Family|Metric|Similarity)\.(?!fit)",
}

html_theme = "pydata_sphinx_theme"
html_title = "alignscores"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_sourcelink_suffix = ""
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": [], "start": [], "faq": []}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
