"""The browser of the system, and pages that must be silent: no messages, no errors, no requests."""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome")


def find_browser() -> str:
    """The browser, or skip; where CI is set there must be one."""
    given = os.environ.get("CHROMIUM")
    found = given if given and shutil.which(given) else next(filter(None, map(shutil.which, _NAMES)), None)
    return found or _without(f"no browser: none of {', '.join(_NAMES)} is installed, and CHROMIUM names none")


def find_driver():
    """Playwright's start, or skip; where CI is set it must be there."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        return _without(f"no browser: {error}")
    return sync_playwright


def _without(reason: str):
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def wait_ready(page) -> float:
    """Seconds from opening the page until everything was drawn."""
    page.wait_for_selector("html[data-ready]", state="attached", timeout=60_000)
    return float(page.evaluate("document.documentElement.dataset.ready")) / 1000.0


@contextmanager
def silent_page(browser, path: Path, **options):
    """Open a page from disk without a network; whatever it asks of one or complains of fails the test."""
    heard: list[str] = []
    with browser.new_context(offline=True, **options) as context:
        page = context.new_page()
        page.on("console", lambda message: heard.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: heard.append(f"error: {error}"))
        page.on("dialog", lambda dialog: (heard.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        page.on("request", lambda request: _hear_request(request.url, heard))
        page.goto(path.as_uri())
        wait_ready(page)
        yield page
    assert heard == []


def _hear_request(url: str, heard: list[str]) -> None:
    # A file saved by the page itself is a blob: address, which leaves the page as little as the page's own file.
    if not url.startswith(("file:", "blob:")):
        heard.append(f"request: {url}")


def select(page, axis: int, start: float, stop: float) -> None:
    """Drag along one of the parallel axes, between shares of its height from its top."""
    box = page.locator("#parallel g.dimension").nth(axis).locator(".brush .overlay").bounding_box()
    drag(page, (box["x"] + 11, box["y"] + start * box["height"]), (box["x"] + 11, box["y"] + stop * box["height"]))


def select_box(page, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """Drag a box in the scatter, between shares of its width and height from its left upper corner."""
    box = page.locator("#scatter .brush .overlay").bounding_box()
    ends = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, stop)]
    drag(page, *ends)


def drag(page, start: tuple[float, float], stop: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*stop, steps=6)
    page.mouse.up()
    settle(page)


def settle(page) -> None:
    """Wait until the next frames are drawn."""
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def conditions(page) -> list[dict]:
    """The conditions of all brushes: column, low, high."""
    return page.evaluate(
        "exploreReport.page.shared.selection.conditions()"
        ".map(c => ({column: c.column, low: String(c.low), high: String(c.high)}))"
    )


def shown_count(page) -> int:
    """The number of selected designs that the page says."""
    return int(page.locator(".total strong").inner_text().split()[0].replace(",", ""))
