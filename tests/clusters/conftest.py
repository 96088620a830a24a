"""Fixtures: a folder in memory, a cluster, the results of an undisturbed sweep."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from run_figures import user_property_values

import explore
from clusters.processes import Cluster, digest, study_file

_FIGURES = "sweeps on real clusters"


@pytest.fixture
def report(request):
    """Collects figures that are printed at the end of the run."""
    return lambda line: request.node.user_properties.append((_FIGURES, line))


def pytest_terminal_summary(terminalreporter) -> None:
    if figures := list(user_property_values(terminalreporter, _FIGURES)):
        terminalreporter.section(_FIGURES)
        for line in figures:
            terminalreporter.line(line)


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder in memory if available: the files are large and need not be durable."""
    parent = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="explore-clusters-", dir=parent) as name:
        yield Path(name)


@pytest.fixture
def cluster(folder) -> Iterator[Cluster]:
    """A scheduler without workers."""
    with Cluster(folder) as cluster:
        yield cluster


@pytest.fixture(scope="session")
def expected_digest(tmp_path_factory):
    """Digest of the results file of an undisturbed sweep of so many blocks, on threads of this process."""
    digests: dict[tuple[int, str], str] = {}

    def digest_of(blocks: int, keep: str = "all") -> str:
        if (blocks, keep) not in digests:
            folder = tmp_path_factory.mktemp("undisturbed")
            path = folder / "undisturbed.h5"
            explore.sweep(explore.load_study(study_file(folder, blocks, keep)), path, workers=2, keep=keep)
            digests[blocks, keep] = digest(path)
            path.unlink()
        return digests[blocks, keep]

    return digest_of
