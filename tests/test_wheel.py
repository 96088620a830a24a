"""A wheel of this tree has the files that are no modules."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from test_comparison_scenes import EXPECTED
from test_report import BUNDLED

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder that a wheel is unpacked to."""
    folder = tmp_path_factory.mktemp("wheel")
    build = "import sys; from hatchling.build import build_wheel; print(build_wheel(sys.argv[1]))"
    built = subprocess.run([sys.executable, "-c", build, folder], cwd=ROOT, capture_output=True, text=True, check=True)
    with zipfile.ZipFile(folder / built.stdout.split()[-1]) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def test_a_wheel_contains_the_scenes(site, tmp_path):
    """They are listed from another folder."""
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from explore.comparison.scenes import bundled_scenes as b;"
        "print(*(f'{path} {path.is_file()}' for path in b().values()), sep='\\n')"
    )
    listing = subprocess.run(
        [sys.executable, "-I", "-c", script, site], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert listing.stdout.split("\n")[:-1] == [
        f"{site}/explore/data/scenes/{name}.toml True" for name in sorted(EXPECTED)
    ]


def test_a_wheel_contains_the_page(site):
    page = site / "explore/figures/reporting/page"
    for name in ("template.html", "page.css", "package-lock.json", *(f"bundle/{name}" for name in BUNDLED)):
        assert (page / name).is_file()
    assert not list(page.rglob("*node_modules*"))
