"""One browser for all tests, and pages of swept studies."""

import os

import pytest
from command_line import succeed
from studies import box, crank_rockers, sweep_text

from browser.chromium import find_browser, find_driver, open_page, silence, silent_page

#: Designs that are feasible, screened, undefined, blocked or cannot be assembled; few, so each value is compared.
STUDY = (
    crank_rockers((60, 180, 9), (900, 1300, 7), (450, 660, 6), (620, 830, 5), speed=[4.0, 8.0])
    + """\
[constraints]
transmission_angle_min = { min = 30 }
rocker_velocity_mean = { min = 0.8, max = 1.2 }
[rank]
metrics = ["cv", "swing_angle:max"]
"""
)


def sobol(count):
    """Designs of a Sobol' sequence, whose values have all digits."""
    return box(f"""count = {count}
[constraints]
transmission_angle_min = {{ min = 30 }}
transmission_angle_max = {{ max = 150 }}
""")


def report_of(path, *, seconds=240):
    """Write the page of a results file beside it."""
    page = path.with_suffix(".html")
    succeed("report", path, "-o", page, seconds=seconds)
    return page


@pytest.fixture(scope="package")  # its event loop would disturb other tests
def browser():
    executable = find_browser()
    # Chromium's sandbox does not run as root, the user of a container.
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    with find_driver()() as driver:
        browser = driver.chromium.launch(executable_path=executable, args=arguments)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    """Results of 3,780 designs, with their page beside the file."""
    results = sweep_text(tmp_path_factory.mktemp("report"), STUDY, "small")
    report_of(results.path)
    return results


@pytest.fixture(scope="session")
def frame(study):
    return study.to_pandas()


@pytest.fixture(scope="package")
def tab(browser):
    """A tab for one page after the other, which takes half of the time of a new one."""
    with browser.new_context(offline=True, viewport={"width": 1400, "height": 1800}) as context:
        yield context.new_page()


@pytest.fixture
def page(tab, study):
    with silence(tab):
        open_page(tab, study.path.with_suffix(".html"))
        yield tab


@pytest.fixture(scope="package")
def unchanged_page(browser, study):
    """The same page, opened once for all tests that only read it or call its functions."""
    with silent_page(browser, study.path.with_suffix(".html"), viewport={"width": 1400, "height": 1800}) as page:
        yield page
