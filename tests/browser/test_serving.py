"""The page of a service in a real browser: log in, submit, dry run, watch, cancel, delete."""

import time

import pytest
from served import Served
from studies import FEW

from browser.service_pages import service_page

LONG = FEW.replace("[80, 100, 150, 160]", "{ start = 100, stop = 140, num = 6_000_000 }").replace(", 720", "")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    server = Served(tmp_path_factory.mktemp("page") / "served")
    yield server
    if server.process.poll() is None:
        server.stop()


@pytest.fixture
def page(browser, served):
    with service_page(browser, served) as page:
        yield page


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
    page.click("[aria-label='browse the results of few']")
    page.wait_for_selector("#ranking tbody tr", timeout=240_000)
    page.click("#subtitle a")
    page.wait_for_selector("#state:text-is('connected')")

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
