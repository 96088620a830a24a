"""The page of a service in a real browser: log in, submit, dry run, watch, cancel, delete."""

import pytest
from served import Served
from studies import FEW
from waiting import wait_until

from browser.service_pages import accessibility_faults, service_page
from explore.results.store.open_results import open_results

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


def delete(page, name):
    """Click Delete, which is refused as long as the sweep is ending; whether the job is gone."""
    with page.expect_response(lambda answer: answer.request.method == "DELETE") as told:
        page.click(f"[aria-label='Delete {name}']")
    return told.value.status == 204


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


def test_designs_of_a_cancelled_job_are_browsed_and_remarks_are_shown(browser, served):
    """What was committed before the job was cancelled, on a telephone; the study has lengths in mm and shows inches."""
    options = {"viewport": {"width": 390, "height": 800}}
    with service_page(browser, served, **options) as page:
        page.goto(f"{served.url}/#token={served.new_link()}")
        page.wait_for_selector("#state:text-is('connected')")
        page.fill("#name", "stopped")
        page.fill("#study", LONG + '[units]\nlength = "in"\n')
        page.click("#form button[type=submit]")
        page.wait_for_selector("#outcome:text-is('stopped is queued')")
        assert page.inner_text("#problems").startswith("perhaps not meant: stopped.toml:")
        assert page.locator("#lines .wrong").count() == 0
        wait_until(lambda: page.evaluate("document.querySelector('#jobs progress').value") > 0)
        page.click("[aria-label='Cancel stopped']")
        page.wait_for_selector("#jobs td:text-is('cancelled')")
        page.click("#jobs summary:text-is('1 remark')")
        assert "although [units] shows in" in page.inner_text("#jobs details")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        assert accessibility_faults(page) == []
        with served.client() as client:
            wait_until(lambda: client.get("/api/jobs/stopped").json()["ended"])
        n_done = open_results(served.folder / "results" / "stopped.h5").n_committed
        assert 0 < n_done < 6_000_000
        page.click("[aria-label='browse the results of stopped']")
        page.wait_for_selector("#ranking tbody tr", timeout=240_000)
        page.wait_for_selector(f"#total:has-text('of {n_done:,} designs')")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        page.goto(served.url)
        wait_until(lambda: delete(page, "stopped"))


def test_a_colleague_is_invited_and_a_link_that_was_used_says_so(browser, page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")
    page.fill("#guest", "Anna")
    page.select_option("#right", "full")
    page.click("#invite button")
    page.wait_for_selector("#link:visible")
    link = page.input_value("#link")
    with service_page(browser, served) as guest:
        guest.goto(link)
        guest.wait_for_selector("#state:text-is('connected')")
        guest.fill("#name", "annas")
        guest.fill("#study", FEW)
        guest.click("#form button[type=submit]")
        page.wait_for_selector("#jobs tr:has(th:text-is('annas')) td:has-text(', Anna')")
        page.wait_for_selector(state("annas", "done"), timeout=240_000)
    edge = "element => element.getBoundingClientRect().right"
    table, button = (page.locator(one).evaluate(edge) for one in ("#list .scrolls", "[aria-label='Delete annas']"))
    assert button <= table, "the actions are beside the screen"
    with service_page(browser, served) as late:
        late.goto(link)
        late.wait_for_selector("#state:has-text('this link was used already')")
    wait_until(lambda: delete(page, "annas"))


def test_a_submission_does_not_wait_for_a_dry_run(page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")
    page.route("**/api/studies?dry_run=true", lambda route: None)  # is never answered
    page.fill("#name", "meanwhile")
    page.fill("#study", FEW)
    page.click("#plan")
    page.wait_for_selector("#outcome:has-text('measuring')")
    page.click("#form button[type=submit]")
    page.wait_for_selector(state("meanwhile", "done"), timeout=240_000)
    assert page.inner_text("#outcome") == "meanwhile is queued"
    wait_until(lambda: delete(page, "meanwhile"))


def test_a_study_is_started_from_edited_and_submitted_by_keys_alone(page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")
    page.wait_for_selector("#start-studies option[value='starters/studies/crank-rocker']", state="attached")
    with served.client() as client:
        starter = client.get("/api/starters/studies/crank-rocker").text
        task = client.get("/api/starters/tasks/dead-positions").text

    assert page.get_attribute("#start-linkages option[value='starters/linkages/jansen']", "title")
    page.focus("#start")
    page.keyboard.type("sl")
    page.wait_for_function("() => document.getElementById('name').value === 'slider-crank'")
    page.keyboard.press("ArrowUp")
    page.wait_for_function("text => document.getElementById('study').value === text", arg=starter)
    assert page.input_value("#name") == "crank-rocker"
    for _ in range(4):
        page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "study"
    page.keyboard.press("Control+A")
    page.keyboard.insert_text(LONG)
    for _ in range(2):
        page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "plan"
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    page.wait_for_selector(state("crank-rocker", "running"), timeout=240_000)
    assert page.evaluate("document.activeElement.textContent") == "Submit"

    page.select_option("#start", "starters/tasks/dead-positions")
    page.wait_for_function("text => document.getElementById('study').value === text", arg=task)
    assert page.input_value("#name") == "dead-positions"
    assert page.is_hidden("#keep"), "a task keeps all its linkages"
    page.click("#form button[type=submit]")
    row = page.locator("#jobs tr:has(th:text-is('dead-positions'))")
    row.locator("td:nth-child(4):text-is('known when found')").wait_for()
    row.locator("input").fill("2")
    page.keyboard.press("Enter")
    with served.client() as client:
        wait_until(lambda: client.get("/api/jobs/dead-positions").json()["priority"] == 2)

    page.focus("[aria-label='Cancel crank-rocker']")
    page.keyboard.press("Enter")
    page.wait_for_selector("[aria-label='Retry crank-rocker']")
    assert page.evaluate("document.activeElement.closest('tr')?.innerText").startswith("crank-rocker"), "focus stays"
    page.wait_for_selector(state("dead-positions", "done"), timeout=240_000)
    assert row.locator("td:nth-child(6)").inner_text().endswith(" %")
    page.click("[aria-label='Refine dead-positions']")
    page.wait_for_selector("#state:text-is('dead-positions-refined is queued')")
    page.wait_for_selector(state("dead-positions-refined", "done"), timeout=240_000)
    page.select_option("#start", "jobs/crank-rocker/study")
    page.wait_for_function("text => document.getElementById('study').value === text", arg=LONG)
    for name in ("crank-rocker", "dead-positions-refined", "dead-positions"):
        wait_until(lambda name=name: delete(page, name))


def test_the_theme_is_remembered_and_telephones_show_all_of_a_job(browser, served):
    with service_page(browser, served, viewport={"width": 390, "height": 800}) as page:
        page.goto(f"{served.url}/#token={served.new_link()}")
        page.wait_for_selector(state("few", "done"))
        page.click("#theme:text-is('Dark')")
        page.goto(f"{served.url}/page/browse.html?results=few")
        page.wait_for_selector("#theme:text-is('Light')")
        page.goto(served.url)
        page.wait_for_selector(state("few", "done"))
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        box = page.locator("[aria-label='Delete few']").bounding_box()
        assert box["x"] + box["width"] <= 390
        assert accessibility_faults(page) == []


def test_a_page_says_so_when_the_server_is_killed_and_goes_on_with_a_new_link(page, served):
    page.goto(f"{served.url}/#token={served.new_link()}")
    page.wait_for_selector("#state:text-is('connected')")
    served.kill()
    page.wait_for_selector("#state:text-is('the server does not answer; trying again …')")
    again = Served(served.folder, port=served.url.rpartition(":")[2])
    try:
        reason = "Open the link that the server printed when it started, or that somebody made for you."
        page.wait_for_selector(f"#state:text-is('{reason}')")
        page.goto("about:blank")
        page.goto(f"{again.url}/#token={again.link}")
        page.wait_for_selector("#state:text-is('connected')")
        page.wait_for_selector(state("few", "done"))
    finally:
        assert again.stop() == 0
