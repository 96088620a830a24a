"""The page of a service in a real browser: log in, submit, dry run, watch, rank, cancel, delete."""

import time

import pytest
from served import Served
from studies import FEW

from browser.chromium import find_browser, find_driver

LONG = FEW.replace("[80, 100, 150, 160]", "{ start = 100, stop = 140, num = 6_000_000 }").replace(", 720", "")
#: What the browser itself logs of an answer to a study with problems, and of a server that was killed.
EXPECTED = ("the server responded with a status of 4", "net::ERR_CONNECTION_REFUSED", "net::ERR_INCOMPLETE_CHUNKED")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    server = Served(tmp_path_factory.mktemp("page") / "served")
    yield server
    if server.process.poll() is None:
        server.stop()


@pytest.fixture
def page(served):
    """A page with its messages, errors and requests elsewhere; there must be none."""
    wrong = []
    with find_driver()() as driver:
        browser = driver.chromium.launch(executable_path=find_browser(), args=["--no-sandbox"])
        page = browser.new_page()
        page.on("console", lambda message: wrong.append(message.text) if is_unexpected(message.text) else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda request: wrong.append(request.url) if not is_own(request.url, served) else None)
        page.on("dialog", lambda dialog: dialog.accept())
        yield page
        browser.close()
    assert wrong == []


def is_unexpected(text):
    return not any(part in text for part in EXPECTED)


def is_own(url, served):
    return url.startswith((f"{served.url}/", "data:,", "about:blank"))


def wait_until(condition, seconds=240):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "not in time"
        time.sleep(0.1)


def delete(page, name):
    """Click Delete, which is refused as long as the sweep is ending; whether the job is gone."""
    if page.is_visible(f"[aria-label='Delete {name}']"):
        page.click(f"[aria-label='Delete {name}']")
    page.wait_for_timeout(200)
    return name not in page.inner_text("#jobs")


def state(name, word):
    return f"#jobs tr:has(th:text-is('{name}')) td:nth-child(2):text-is('{word}')"


def test_a_day_with_the_page(page, served):
    page.goto(f"{served.url}/#token={served.link}")
    page.wait_for_selector("#state:text-is('connected')")
    assert page.url == f"{served.url}/", "the token is gone from the address"

    page.fill("#name", "few")
    page.fill("#study", FEW.replace("crank =", "cranc ="))
    page.click("#form button[type=submit]")
    page.wait_for_selector("#problems li")
    assert "few.toml:3: parameters.cranc: unknown parameter" in page.inner_text("#problems")
    assert page.inner_text("#lines .wrong") == "3"
    page.click("#problems button")
    selected = "document.activeElement.value.slice(study.selectionStart, study.selectionEnd)"
    assert page.evaluate(f"(() => {{ const study = document.activeElement; return {selected} }})()").startswith("cranc")

    page.fill("#study", FEW)
    page.click("#plan")
    page.wait_for_selector("#outcome:has-text('8 designs')", timeout=240_000)
    page.click("#form button[type=submit]")
    page.wait_for_selector(state("few", "done"), timeout=240_000)
    page.click("[aria-label='Pareto set few']")
    page.wait_for_selector("#results-table tbody tr")
    assert "Pareto-optimal designs in cv:min" in page.inner_text("#results-facts")
    assert "crank (mm)" in page.inner_text("#results-table thead")

    page.fill("#name", "long")
    page.fill("#study", LONG)
    page.click("#form button[type=submit]")
    page.wait_for_selector(state("long", "running"), timeout=240_000)
    wait_until(lambda: page.evaluate("document.querySelector('#jobs progress').value") > 0)
    page.click("[aria-label='Cancel long']")
    page.wait_for_selector(state("long", "cancelled"))
    wait_until(lambda: delete(page, "long"))
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_page_says_so_when_the_server_is_killed_and_goes_on_with_a_new_link(page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")
    served.kill()
    page.wait_for_selector("#state:text-is('the server does not answer; trying again …')")
    again = Served(served.folder, port=served.url.rpartition(":")[2])
    try:
        page.wait_for_selector("#state:text-is('Open the link that the server printed when it started.')")
        page.goto("about:blank")
        page.goto(f"{again.url}/#token={again.link}")
        page.wait_for_selector("#state:text-is('connected')")
        page.wait_for_selector(state("few", "done"))
    finally:
        assert again.stop() == 0
