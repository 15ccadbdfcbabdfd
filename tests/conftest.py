"""What all test modules share: reference values, Hypothesis' settings, and a browser."""

import gc
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from html import unescape
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

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
)
# Root, and most containers, cannot have the sandbox; the pages are the project's own.
FLAGS = "--headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run"
FLAGS += " --disable-background-networking --disable-component-update --disable-extensions"
FLAGS += " --disable-sync --enable-logging=stderr --virtual-time-budget=10000"
FLAGS += " --window-size=1280,900 --dump-dom"
# What a script has found out takes the place of the page.
TELL = """
const tell = (outcome) => {
  document.body.innerHTML = "<pre></pre>";
  document.body.firstChild.textContent = JSON.stringify(outcome);
};
"""
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

# The processes that run tests side by side inherit it, and the programs that they start: further
# threads of BLAS would only spin until a core is free.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Without it each of the many programs that tests start would compile the project anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Same examples in every run, and no time limit for each: the machine may be busy.
settings.register_profile("alignscores", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("alignscores")


def pytest_xdist_auto_num_workers() -> int:
    """One process more than cores: some tests wait for the programs that they have started."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_finish() -> None:
    """Spare the garbage collector the thousands of tests: it would visit them again and again."""
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest tests, so that no process waits for another at the end."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)


@dataclass(frozen=True)
class ReferenceCase:
    """One trajectory with the outputs of the published implementation; ``case["d_threshold"]``."""

    name: str
    meta: Mapping[str, Any]
    arrays: Mapping[str, Floats]

    def __getitem__(self, array: str) -> Floats:
        return self.arrays[array]


@pytest.fixture(scope="session")
def reference_cases() -> dict[str, ReferenceCase]:
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
def reference_case(
    request: pytest.FixtureRequest, reference_cases: dict[str, ReferenceCase]
) -> ReferenceCase:
    """One case, named by ``@pytest.mark.parametrize("reference_case", [...], indirect=True)``."""
    if request.param not in reference_cases:
        pytest.skip(f"{request.param} is not in {REFERENCE[0].name}")
    return reference_cases[request.param]


class Browser:
    """Chromium or Chrome without a window; every page is opened in a profile of its own."""

    def __init__(self, program: str, new_folder: Callable[[str], Path]) -> None:
        self.program, self.new_folder = program, new_folder
        self.told: dict[tuple[str, str, str], Any] = {}

    def run(self, html: str, script: str, fragment: str = "") -> Any:
        """Open a page, run a script at its end, and return what it passes to ``tell``.

        The same page with the same script is opened once.
        """
        key = html, script, fragment
        if key not in self.told:
            self.told[key] = self._run(html, script, fragment)
        return deepcopy(self.told[key])

    def _run(self, html: str, script: str, fragment: str) -> Any:
        folder = self.new_folder("browser")
        return self._open(_write(folder / "page.html", html, TELL + script), fragment)

    def run_at_widths(self, html: str, script: str, widths: Sequence[int]) -> dict[int, Any]:
        """Do so on screens of some widths, down to a phone's."""
        folder = self.new_folder("browser")
        tell = 'const tell = (outcome) => parent.postMessage(outcome, "*");'
        _write(folder / "page.html", html, tell + script)
        frames = "".join(
            f'<iframe width="{w}" height="800" src="page.html"></iframe>' for w in widths
        )
        (folder / "frames.html").write_text(FRAMES.format(frames=frames, tell=TELL))
        return {int(width): told for width, told in self._open(folder / "frames.html").items()}

    def _open(self, path: Path, fragment: str = "") -> Any:
        profile = f"--user-data-dir={path.parent / 'profile'}"
        address = path.as_uri() + fragment
        done = subprocess.run(
            [self.program, *FLAGS.split(), profile, address],
            capture_output=True,
            encoding="utf-8",
            timeout=100,
            env=os.environ | {"HOME": str(path.parent)},
        )
        assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
        _, found, text = done.stdout.rpartition("<pre>")
        assert found, done.stdout[-2000:] + done.stderr[-2000:]
        return json.loads(unescape(text.partition("</pre>")[0]))


def _write(path: Path, html: str, script: str) -> Path:
    before, body, after = html.rpartition("</body>")
    assert body
    path.write_text(f"{before}<script>{script}</script>{body}{after}", encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Browser:
    """The browser; without one the test is skipped, but where CI is true it fails."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        reason = "no Chromium or Chrome on this machine"
        if os.environ.get("CI") == "true":
            pytest.fail(f"{reason}, and with CI=true no browser test may be skipped")
        pytest.skip(reason)
    return Browser(program, tmp_path_factory.mktemp)
