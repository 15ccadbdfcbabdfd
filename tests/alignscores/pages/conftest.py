"""A browser for the pages."""

import os
import shutil

import pytest
from playwright.sync_api import sync_playwright

PROGRAMS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)


@pytest.fixture(scope="module")
def chromium():
    """Chromium or Chrome; without one the test is skipped, but where CI is true it fails."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        reason = "no Chromium or Chrome on this machine"
        if os.environ.get("CI") == "true":
            pytest.fail(f"{reason}, and with CI=true no browser test may be skipped")
        pytest.skip(reason)
    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=program)


@pytest.fixture
def browse(chromium, tmp_path):
    """(html, width) -> the page, open; none may complain on the console."""
    complaints = []
    context = chromium.new_context()

    def browse(html, width=1280):
        path = tmp_path / "browsed.html"
        path.write_text(html, encoding="utf-8")
        page = context.new_page()
        page.set_viewport_size({"width": width, "height": 900})
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(path.as_uri())
        return page

    yield browse
    context.close()
    assert complaints == []
