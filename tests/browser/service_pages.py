"""Pages of a service in the browser."""

import contextlib

from axe_playwright_python.sync_playwright import Axe

#: What the browser itself logs of an answer to a study with problems, and of a server that was killed.
EXPECTED = ("the server responded with a status of 4", "net::ERR_CONNECTION_REFUSED", "net::ERR_INCOMPLETE_CHUNKED")


@contextlib.contextmanager
def service_page(browser, served, **options):
    """A page in a context of its own; there must be no errors and no requests elsewhere."""
    wrong = []
    context = browser.new_context(**options)
    page = context.new_page()
    page.on("console", lambda message: wrong.append(message.text) if is_unexpected(message.text) else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: wrong.append(request.url) if not is_own(request.url, served) else None)
    page.on("dialog", lambda dialog: dialog.accept())
    yield page
    context.close()
    assert wrong == [], wrong


def is_unexpected(text):
    return not any(part in text for part in EXPECTED)


def is_own(url, served):
    return url.startswith((f"{served.url}/", "data:,", "about:blank"))


def accessibility_faults(page):
    """What axe-core finds on the page that is serious or critical: the rule and the first element."""
    faults = Axe().run(page).response["violations"]
    return [(fault["id"], fault["nodes"][0]["html"]) for fault in faults if fault["impact"] in ("serious", "critical")]
