"""The bytes of the results file do not depend on the cluster or the order of the blocks."""

import random

import pytest
from studies import grid

import explore
from clusters.processes import Cluster, digest
from explore.running.collectors import AllDesignsCollector, FrontCollector

#: Every kind of column, three blocks and a part of one: moments, extremes, constraints, several speeds.
STUDY = grid(
    """\
[constraints]
transmission_angle_min = { min = 20 }
[rank]
metrics = ["cv", "transmission_angle_min:max"]
""",
    num=22,
)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A cluster of two workers, which start while other sweeps run."""
    with Cluster(tmp_path_factory.mktemp("cluster")) as cluster:
        for _ in range(2):
            cluster.add_worker()
        yield cluster


@pytest.fixture
def study(folder):
    path = folder / "study.toml"
    path.write_text(STUDY)
    return explore.load_study(path)


class Interrupted(Exception):
    """Raised after a commit."""


def interrupt(*_):
    raise Interrupted


@pytest.mark.parametrize(("keep", "collector"), [("all", AllDesignsCollector), ("front", FrontCollector)])
def test_the_same_bytes_from_threads_processes_clusters_orders_and_resumed_sweeps(
    folder, study, cluster: Cluster, monkeypatch, keep, collector
):
    from distributed import Client

    def sweep(name, **options):
        path = folder / f"{name}.h5"
        explore.sweep(study, path, keep=keep, **options)
        digests[name] = digest(path)
        path.unlink()

    digests: dict[str, str] = {}
    assert study.space.n_blocks == 4
    for threads in (1, 2, 4):
        sweep(f"{threads} threads", workers=threads)
    sweep("processes", workers=2, processes=True)
    cluster.wait_for_workers(2)
    with Client(cluster.address, set_as_default=False) as client:
        sweep("tcp", client=client)
    for _ in range(3):
        with pytest.raises(Interrupted):
            explore.sweep(study, folder / "resumed.h5", workers=2, keep=keep, report_progress=interrupt)
    sweep("resumed", workers=2)
    read_pending = collector.pending.fget
    for seed in range(2):
        shuffle = random.Random(seed).sample
        shuffled_blocks = property(lambda self, s=shuffle: s(blocks := list(read_pending(self)), len(blocks)))
        monkeypatch.setattr(collector, "pending", shuffled_blocks)
        sweep(f"shuffled {seed}", workers=2)

    assert len(set(digests.values())) == 1, digests
