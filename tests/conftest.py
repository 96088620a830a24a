"""Fixtures of more than one file."""

import codecs
import gc
import os
import signal
import tempfile
from functools import cache
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: the workers share the cores
os.environ["PYTHONSAFEPATH"] = "1"  # processes import the installed package too, not the folder they are started in

import pytest
from damage_worker import Worker
from store_files import fill
from studies import FEW, sweep_text

from explore.base.errors import ConfigError
from explore.results.store.packing import pack
from explore.studies.config.study_file import load_study

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as in the background of a shell; processes would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

#: Beginnings of the names of the longest files, one that computes after one that waits; they are run first.
LONGEST = (
    "clusters/test_kills", "test_contract", "clusters/test_interrupts", "test_linkages", "clusters/test_silence",
    "test_synthesis_motion", "test_serving_jobs", "test_compiling", "clusters/", "test_docs", "test_serving_http",
    "faults/", "test_synthesis_nine", "browser/", "test_cli_comparisons", "test_serving_",
    "test_synthesis_", "test_browsing_http", "test_variable_crank", "test_target_kinds", "test_fuzz_",
    "test_linkage_code", "test_methods", "test_slider_crank", "test_campaign_", "test_comparison_",
)  # fmt: skip


def pytest_configure(config):
    """Give files to the workers of pytest-xdist in the order below, not those with the most tests first."""
    config.option.loadscopereorder = False


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect thousands of tests without looking for garbage, half of the time, and never look for it among them."""
    gc.disable()
    result = yield
    gc.freeze()
    gc.enable()
    return result


def pytest_collection_modifyitems(items):
    """Begin with the longest files, so that no worker ends alone with one of them."""
    items.sort(key=lambda item: place_in_order(item.path))


@cache
def place_in_order(path):
    """The place of a file among the longest ones, or after them."""
    file = path.relative_to(Path(__file__).parent).as_posix()
    return next((place for place, beginning in enumerate(LONGEST) if file.startswith(beginning)), len(LONGEST))


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Load a text as the file study.toml of the current folder."""
    monkeypatch.chdir(tmp_path)

    def load_text(text):
        Path("study.toml").write_text(text, encoding="utf-8", newline="")
        return load_study("study.toml")

    return load_text


@pytest.fixture
def problems(load):
    """Problems of a text as the file study.toml of the current folder."""

    def problems_of(text):
        with pytest.raises(ConfigError) as caught:
            load(text)
        assert str(caught.value) == "\n".join(caught.value.problems)
        return caught.value.problems

    return problems_of


@pytest.fixture
def client(served):
    """A client of the service of the module."""
    with served.client() as client:
        yield client


@pytest.fixture
def unprivileged():
    """A folder that all users may enter, and a function that drops the privileges of the superuser."""
    superuser = os.geteuid() == 0
    codecs.lookup("utf-8-sig")  # imported now: the other user may not read Python's own files
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder), lambda: os.seteuid(65_534) if superuser else None
        if superuser:
            os.seteuid(0)
        Path(folder).chmod(0o755)


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A finished results file, not to be changed."""
    return fill(tmp_path_factory.mktemp("finished") / "grid.h5")


@pytest.fixture
def copy(finished, tmp_path) -> Path:
    """A finished results file to be changed."""
    path = tmp_path / "copy.h5"
    path.write_bytes(finished.read_bytes())
    return path


@pytest.fixture(scope="session")
def packed(finished, tmp_path_factory) -> Path:
    """A packed copy of the finished results file, not to be changed."""
    path = tmp_path_factory.mktemp("packed") / "grid.packed.h5"
    pack(finished, path)
    return path


@pytest.fixture
def packed_copy(packed, tmp_path) -> Path:
    """A packed file to be changed."""
    path = tmp_path / "copy.h5"
    path.write_bytes(packed.read_bytes())
    return path


@pytest.fixture(scope="session")
def few(tmp_path_factory) -> Path:
    """Results of a small study, not to be changed."""
    folder = tmp_path_factory.mktemp("few")
    return sweep_text(folder, FEW, "small").path


@pytest.fixture
def in_results(few, tmp_path, monkeypatch) -> Path:
    """The current folder, with these results as results/small.h5."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results/small.h5").write_bytes(few.read_bytes())
    return tmp_path


@pytest.fixture(scope="module")
def worker():
    """A process with limited memory, which HDF5 may crash."""
    worker = Worker()
    yield worker
    worker.close()
