"""The system's browser, and pages that must not log messages, raise errors or make requests."""

import os
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

_BROWSER_NAMES = ("chromium", "chromium-browser", "google-chrome")
#: Time to sort a million numbers on the machine that limits of seconds are for, s.
_SORT_SECONDS = 0.1
#: Sorts a million numbers of a linear congruential generator, and returns the time, ms.
_SORT = """() => {
    const numbers = new Float64Array(1e6);
    let number = 1;
    for (let k = 0; k < numbers.length; k++) numbers[k] = number = (number * 1103515245 + 12345) % 2147483648;
    const begun = performance.now();
    numbers.sort();
    return performance.now() - begun;
}"""


def find_browser() -> str:
    """Path of the browser. Without one the test is skipped, or fails where CI is set."""
    candidates = (os.environ.get("CHROMIUM"), *_BROWSER_NAMES)
    browser = next((path for name in candidates if name and (path := shutil.which(name))), None)
    return browser or _skip(f"no browser: none of {', '.join(_BROWSER_NAMES)} is installed, and CHROMIUM names none")


def find_driver():
    """Playwright's entry point. Without Playwright the test is skipped, or fails where CI is set."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        return _skip(f"no browser: {error}")
    return sync_playwright


def _skip(reason: str):
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def wait_ready(page) -> float:
    """Wait until everything is drawn; return the seconds since the page was opened."""
    page.wait_for_selector("html[data-ready]", state="attached", timeout=240_000)
    return float(page.evaluate("document.documentElement.dataset.ready")) / 1000.0


def slowness(page) -> float:
    """How many times as long as on the machine that limits are for this one takes for a page's work, at least 1."""
    return max(1.0, page.evaluate(_SORT) / 1000.0 / _SORT_SECONDS)


@contextmanager
def silent_page(browser, path: Path, **options):
    """Open a page from disk in a new tab without a network; a request, message, dialog or error fails the test."""
    with browser.new_context(offline=True, **options) as context, silence(context.new_page()) as tab:
        open_page(tab, path)
        yield tab


def open_page(tab, path: Path) -> None:
    """Open a page from disk, again if it is open, with the mouse where nothing is."""
    tab.mouse.move(0, 0)
    tab.goto(path.as_uri())
    wait_ready(tab)


@contextmanager
def silence(tab):
    """Requests, messages, dialogs and errors of a tab fail the test."""
    events: list[str] = []
    listeners = {
        "console": lambda message: events.append(f"console: {message.text}"),
        "pageerror": lambda error: events.append(f"error: {error}"),
        "dialog": lambda dialog: (events.append(f"dialog: {dialog.message}"), dialog.dismiss()),
        # A file that the page saves has a blob: address, which needs no network either.
        "request": lambda request: (
            None if request.url.startswith(("file:", "blob:")) else events.append(f"request: {request.url}")
        ),
    }
    for name, listener in listeners.items():
        tab.on(name, listener)
    yield tab
    settle(tab)  # what is under way has arrived
    for name, listener in listeners.items():
        tab.remove_listener(name, listener)
    assert events == []


def select(page, axis: int, start: float, stop: float) -> None:
    """Drag along a parallel axis, between fractions of its height from the top."""
    box = page.locator("#parallel g.dimension").nth(axis).locator(".brush .overlay").bounding_box()
    drag(page, (box["x"] + 11, box["y"] + start * box["height"]), (box["x"] + 11, box["y"] + stop * box["height"]))


def select_box(page, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """Drag a box in the scatter, between fractions of its width and height from the upper left corner."""
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
    """The number of selected designs that the page shows."""
    return int(page.locator(".total strong").inner_text().split()[0].replace(",", ""))
