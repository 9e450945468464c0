"""A headless browser for pages of archives."""

import shutil
from pathlib import Path

import pytest

from tests.pages import Look, check

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def _executable(playwright):
    """A Chromium: of the machine, or the one that playwright installed."""
    own = playwright.chromium.executable_path
    found = next(filter(None, map(shutil.which, NAMES)), None)
    return found or (own if Path(own).exists() else None)


@pytest.fixture(scope="session")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    with api.sync_playwright() as playwright:
        executable = _executable(playwright)
        if executable is None:
            pytest.skip("no Chromium on this machine; `playwright install chromium` brings one")
        options = ["--no-sandbox", "--disable-gpu"]
        browser = playwright.chromium.launch(executable_path=executable, args=options)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def opened(browser):
    """Open a page in a context of its own: ``opened(path)``."""
    contexts = []

    def open_(path):
        size = {"width": 1400, "height": 900}
        contexts.append(browser.new_context(viewport=size, color_scheme="light", offline=True))
        return Look(contexts[-1].new_page(), path)

    yield open_
    for context in contexts:
        context.close()


@pytest.fixture
def look(opened):
    """Open a page that no other test looks at: ``look(path)``."""
    looks = []

    def once(path):
        looks.append(opened(path))
        return looks[-1]

    yield once
    for each in looks:
        check(each)
        each.page.close()
