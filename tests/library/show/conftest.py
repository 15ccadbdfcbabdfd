"""A browser for the pages, which they ask for nothing."""

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


# Warnings of Chromium itself, and what plotly makes for its own use.
DRIVERS = "willReadFrequently", "GPU stall due to ReadPixels", "blob:"


@pytest.fixture
def opened(chromium, tmp_path):
    """(page) -> the page in a browser; it requests nothing, and nothing of ours complains."""
    wrong = []
    context = chromium.new_context(viewport={"width": 1280, "height": 900})

    def opened(html):
        path = tmp_path / "opened.html"
        path.write_text(html, encoding="utf-8")
        page = context.new_page()
        page.set_default_timeout(100_000)
        page.on("request", lambda request: wrong.append(request.url))
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(path.as_uri())
        wrong.remove(path.as_uri())
        return page

    yield opened
    context.close()
    assert [text for text in wrong if not any(driver in text for driver in DRIVERS)] == []
