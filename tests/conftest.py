"""What all test modules share: reference values, Hypothesis' settings, and a browser."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from alignscores.arrays import Floats

os.environ["COLUMNS"] = "100"  # of tables; pytest-xdist sets 80

TESTS = Path(__file__).resolve().parent
REFERENCE = (  # the second has further cases of 200 cameras and more
    TESTS / "data" / "published.npz",
    TESTS.parents[1] / "shared" / "reference" / "alignment_scores_octave.npz",
)

OF_LEVELS = {  # folders and files, as in README.md
    "mathematics": ("alignscores", "baselines"),
    "library": (
        *("alignscores/comparison", "alignscores/evaluation", "alignscores/pages"),
        *("alignscores/test_plots.py", "alignscores/test_real.py", "alignscores/test_rerun.py"),
        *("alignscores/test_torch.py", "alignscores/trajectories"),
    ),
    "command": ("alignscores/cli", "golden"),
    "study": ("cluster", "experiments", "figures", "report", "studies", "workflow"),
    "house": (
        *(".", "alignscores/test_interface.py", "alignscores/test_interruptions.py"),
        *("alignscores/test_parallel.py", "alignscores/test_straight_lines.py"),
        *("alignscores/test_structure.py", "alignscores/test_texts.py"),
        *("alignscores/test_writing.py", "alignscores/test_yaml_files.py", "benchmarks"),
    ),
}
LEVELS = {Path(path): level for level, paths in OF_LEVELS.items() for path in paths}

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
# Root, and most containers, cannot have the sandbox; the pages are the project's own.
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run"
FLAGS += " --disable-background-networking --disable-component-update --disable-extensions"
FLAGS += " --disable-sync --window-size=1280,900 --remote-debugging-pipe"
# Ten seconds that pass as fast as scripts and frames have something to do or to load.
CLOCK = {"policy": "pauseIfNetworkFetchesPending", "budget": 10_000}
CLOCK |= {"maxVirtualTimeTaskStarvationCount": 9999}
RUN_OUT = "Emulation.virtualTimeBudgetExpired"
COMPLAINTS = {"Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown"}
# The result of a script is stored next to the page, which may go on drawing.
TELL = """
const tell = (outcome) => { document.told = JSON.stringify(outcome); };
"""
TOLD = "document.told"
# A window has a least width, a frame has not; each tells the page around it.
FRAMES = """<!DOCTYPE html><html><body>{frames}<script>
{tell}
const told = {{}};
addEventListener("message", (event) => {{
  const frames = [...document.querySelectorAll("iframe")];
  const frame = frames.find((each) => each.contentWindow === event.source);
  told[frame.width] = event.data;
  if (Object.keys(told).length === frames.length) tell(told);
}});
</script></body></html>
"""

# The processes that run tests in parallel inherit it, and the programs that they start: further
# threads of BLAS would only spin until a core is free.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Fonts and sources that programs keep for later: no test depends on the home directory.
os.environ["XDG_CACHE_HOME"] = str(TESTS.parent / ".pytest_cache" / "programs")
# Without it each of the many programs that tests start would compile the project anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


class SkipWithoutWheel(MetaPathFinder):
    """Asked last: a test that imports pycolmap is skipped where there is none, as on ARM Linux."""

    def find_spec(self, fullname, path, target=None):
        """Skip."""
        if fullname == "pycolmap":
            pytest.skip("pycolmap is not installed", allow_module_level=True)


sys.meta_path.append(SkipWithoutWheel())

# Same examples in every run, and no time limit for each: the machine may be busy.
settings.register_profile("alignscores", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("alignscores")


@pytest.hookimpl(optionalhook=True)  # a release tests its wheels without pytest-xdist
def pytest_xdist_auto_num_workers():
    """One process more than cores: some tests wait for the programs that they have started."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items):
    """Mark each test with its level; begin with the longest tests, so that no process waits."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)
    for item in items:
        if TESTS in item.path.parents:
            path = item.path.relative_to(TESTS)
            item.add_marker(next(LEVELS[p] for p in (path, *path.parents) if p in LEVELS))


@dataclass(frozen=True)
class ReferenceCase:
    """One trajectory with the outputs of the published implementation; ``case["d_threshold"]``."""

    name: str
    meta: Mapping[str, Any]
    arrays: Mapping[str, Floats]

    def __getitem__(self, array):
        return self.arrays[array]


@pytest.fixture(scope="session")
def reference_cases():
    """All cases of the reference files by name."""
    cases = {}
    for path in filter(Path.exists, REFERENCE):
        with np.load(path, allow_pickle=False) as file:
            for text in file["cases"]:
                meta = json.loads(str(text))
                prefix = meta["case"] + "/"
                arrays = {k.removeprefix(prefix): file[k] for k in file if k.startswith(prefix)}
                cases[meta["case"]] = ReferenceCase(meta["case"], meta, arrays)
    return cases


@pytest.fixture
def reference_case(request, reference_cases):
    """One case, named by ``@pytest.mark.parametrize("reference_case", [...], indirect=True)``."""
    if request.param not in reference_cases:
        pytest.skip(f"{request.param} is not in {REFERENCE[0].name}")
    return reference_cases[request.param]


class Browser:
    """Chromium or Chrome without a window, started once: pages follow each other in one tab.

    It takes messages of the Chrome DevTools Protocol from a pipe and answers through another.
    """

    def __init__(self, program, new_folder):
        self.new_folder = new_folder
        self.told: dict[tuple[str, str, str], Any] = {}
        self.events: list[Any] = []  # since the page was opened
        self.number, self.unread = 0, b""
        folder = new_folder("browser")
        theirs, self.requests = os.pipe()
        self.answers, their_answers = os.pipe()
        flags = [*FLAGS.split(), f"--user-data-dir={folder / 'profile'}"]
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{theirs} 4>&{their_answers}', "", program, *flags],
            pass_fds=(theirs, their_answers),
            stderr=subprocess.DEVNULL,
            env=os.environ | {"HOME": str(folder)},
        )
        os.close(theirs)
        os.close(their_answers)
        self.tab: dict[str, str] = {}
        target = self._ask("Target.createTarget", url="about:blank")
        self.tab = self._ask("Target.attachToTarget", flatten=True, **target)
        for domain in ("Page", "Runtime", "Log"):
            self._ask(f"{domain}.enable")

    def close(self):
        """End it."""
        self.process.kill()
        self.process.wait()
        os.close(self.requests)
        os.close(self.answers)

    def run(self, html, script, fragment=""):
        """Open a page, run a script at its end, and return what it passes to ``tell``.

        The same page with the same script is opened once.
        """
        key = html, script, fragment
        if key not in self.told:
            path = _write(self.new_folder("browser") / "page.html", html, TELL + script)
            self.told[key] = self._open(path, fragment)
        return deepcopy(self.told[key])

    def run_at_widths(self, html, script, widths):
        """Do so on screens of some widths, down to a phone's."""
        folder = self.new_folder("browser")
        tell = 'const tell = (outcome) => parent.postMessage(outcome, "*");'
        _write(folder / "page.html", html, tell + script)
        frames = "".join(
            f'<iframe width="{w}" height="800" src="page.html"></iframe>' for w in widths
        )
        (folder / "frames.html").write_text(FRAMES.format(frames=frames, tell=TELL))
        return {int(width): told for width, told in self._open(folder / "frames.html").items()}

    def _open(self, path, fragment=""):
        """Open a page, let its clock run out, and return what it has told."""
        self._ask("Emulation.setVirtualTimePolicy", policy="pause")
        self.events.clear()
        self._ask("Page.navigate", url=path.as_uri() + fragment)
        self._ask("Emulation.setVirtualTimePolicy", **CLOCK)
        while not any(event["method"] == RUN_OUT for event in self.events):
            self.events.append(self._read())
        found = self._ask("Runtime.evaluate", expression=TOLD)["result"].get("value")
        assert [event for event in self.events if event["method"] in COMPLAINTS] == []
        assert found is not None, "the script has told nothing"
        return json.loads(found)

    def _ask(self, method, **parameters):
        """Send a message, and return what is answered to it."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters, **self.tab}
        os.write(self.requests, json.dumps(message).encode() + b"\0")
        while (answer := self._read()).get("id") != self.number:
            self.events.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def _read(self):
        """Wait for the next message, an answer or an event; each ends in a zero."""
        while b"\0" not in self.unread:
            piece = os.read(self.answers, 1 << 20)
            assert piece, "the browser has ended"
            self.unread += piece
        message, _, self.unread = self.unread.partition(b"\0")
        return json.loads(message)


def _write(path, html, script):
    before, body, after = html.rpartition("</body>")
    assert body
    path.write_text(f"{before}<script>{script}</script>{body}{after}", encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """The browser; without one the test is skipped, but where CI is true it fails."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        reason = "no Chromium or Chrome on this machine"
        if os.environ.get("CI") == "true":
            pytest.fail(f"{reason}, and with CI=true no browser test may be skipped")
        pytest.skip(reason)
    browser = Browser(program, tmp_path_factory.mktemp)
    yield browser
    browser.close()
