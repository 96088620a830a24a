"""Pages of a service in the browser."""

import contextlib

from axe_playwright_python.sync_playwright import Axe

#: What the browser itself logs of an answer to a study with problems, and of a server that was killed.
EXPECTED = ("the server responded with a status of 4", "net::ERR_CONNECTION_REFUSED", "net::ERR_INCOMPLETE_CHUNKED")


@contextlib.contextmanager
def service_page(browser, served, **options):
    """A page in a context of its own; there must be no errors and no requests elsewhere."""
    wrong = []
    with browser.new_context(**options) as context:
        page = context.new_page()
        page.on("dialog", lambda dialog: dialog.accept())
        for name, listener in listeners(wrong, served).items():
            page.on(name, listener)
        yield page
    assert wrong == [], wrong


@contextlib.contextmanager
def watched(page, served):
    """There must be no errors and no requests elsewhere meanwhile; the page is left empty."""
    wrong = []
    own = listeners(wrong, served)
    for name, listener in own.items():
        page.on(name, listener)
    yield page
    page.goto("about:blank")
    for name, listener in own.items():
        page.remove_listener(name, listener)
    assert wrong == [], wrong


def listeners(wrong, served):
    """What notes messages, errors and requests elsewhere of a page."""
    return {
        "console": lambda message: wrong.append(message.text) if is_unexpected(message.text) else None,
        "pageerror": lambda error: wrong.append(str(error)),
        "request": lambda request: wrong.append(request.url) if not is_own(request.url, served) else None,
    }


def is_unexpected(text):
    return not any(part in text for part in EXPECTED)


def is_own(url, served):
    return url.startswith((f"{served.url}/", "data:,", "about:blank"))


def accessibility_faults(page):
    """What axe-core finds on the page that is serious or critical: the rule and the first element."""
    faults = Axe().run(page).response["violations"]
    return [(fault["id"], fault["nodes"][0]["html"]) for fault in faults if fault["impact"] in ("serious", "critical")]
