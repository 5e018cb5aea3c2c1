# Copyright 2026 ahv developers, Apache-2.0
"""How tests look at pages: in headless Chromium, which draws three dimensions in software."""

import os
import shutil
from pathlib import Path

import pytest

from test.waiting import PATIENCE, wait_until

# three dimensions by the software that Chromium has for it, but not the plots: dashed lines of
# 15 001 points take it half a minute
SOFTWARE_GL = [
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--disable-accelerated-2d-canvas", "--disable-gpu-rasterization"),
]


@pytest.fixture(scope="module")
def browser():
    """A Chromium; without one the test is skipped, and with CI=true it fails."""
    from playwright.sync_api import sync_playwright  # what may be absent

    path = shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        stop = pytest.fail if os.environ.get("CI") == "true" else pytest.skip
        stop("there is no Chromium to look at the pages with (Debian: apt-get install chromium)")
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=path,
            timeout=1e3 * PATIENCE,  # [ms]
            args=SOFTWARE_GL,
        )
        yield chromium
        chromium.close()


@pytest.fixture
def visit(browser):
    """Open a page; the function gives the page and what it asked for and complained of.

    `first` is a script to run before any of the page's own.
    """
    contexts = []

    def opened(file, first="", **options):
        contexts.append(browser.new_context(**options))
        contexts[-1].set_default_timeout(1e3 * PATIENCE)  # [ms]
        page = contexts[-1].new_page()
        if first:
            page.add_init_script(first)
        requests, complaints = [], []
        page.on("request", lambda request: requests.append(request.url))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(Path(file).as_uri())
        wait_for(page, "charts.length === drawings.length")
        return page, requests, complaints

    yield opened
    for context in contexts:
        context.close()


def wait_for(page, condition):
    """Wait until it holds. The page's policy forbids the `eval` with which playwright waits."""
    wait_until(lambda: page.evaluate(condition), condition, lambda: page.wait_for_timeout(20))
