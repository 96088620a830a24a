"""All kinds of readers open a results file repeatedly while a sweep in another process writes it."""

import contextlib
import json
import os
import random
import subprocess
import sys
import time
import zlib
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

import explore

BLOCK, N_BLOCKS = 65_536, 60
N_DESIGNS = N_BLOCKS * BLOCK - 1000  # the last block is shorter
#: Few columns keep the file small; the maximum of an acceleration keeps the sweep slow enough to watch.
STUDY = f"""mechanism = "crank-rocker"
[parameters]
crank = {{ start = 60, stop = 130, num = {N_DESIGNS} }}
coupler = 1083.4236
rocker = 541.7118
ground = 691.7118
[evaluate]
window = "cycle"
tolerance = 1e-11
metrics = ["rocker_velocity_variance", "rocker_acceleration_max"]
[rank]
metrics = ["rocker_velocity_variance:min"]
"""
OPENS = 400
#: Most sweeps to watch; each gives some hundred opens, on a busy machine fewer.
SWEEPS = 60


def start(*arguments, folder):
    """Run `explore` as a separate process."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "NO_COLOR": "1"}
    command = [sys.executable, "-m", "explore", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


class Watcher:
    """Reads a growing file in several ways and compares each with the commit words that it reads itself."""

    def __init__(self, path):
        self.path = path
        self.chance = random.Random(1)
        self.seen = np.zeros(N_BLOCKS, np.uint64)
        self.opens = self.early = 0

    def open(self):
        """One open by the next kind of reader."""
        self.opens += 1
        before = self.seen
        kind = self.opens % 50
        reader = (
            self.pandas if kind == 49 else self.xarray if kind % 25 == 4 else self.product if kind % 2 else self.h5py
        )
        reader()
        self.early += 0 < np.count_nonzero(before) < N_BLOCKS

    def words(self, file):
        """The commit words; a written one never changes."""
        words = file["progress/commit"][:, 0]
        is_known = self.seen != 0
        assert np.array_equal(words[is_known], self.seen[is_known]), "a commit word changed"
        assert np.all((words == 0) | (words >> 32 == 1))
        new = np.flatnonzero((words != 0) & ~is_known).tolist()
        self.seen = words
        return new

    def h5py(self):
        """CRC-32 of new blocks and of an old one, in the columns' order."""
        with h5py.File(self.path) as file:
            names = ["design", *(name.decode() for name in file["frame/axis0"][:])]
            numbers = self.words(file)
            committed = np.flatnonzero(self.seen).tolist()
            for number in {*numbers, *self.chance.sample(committed, min(1, len(committed)))}:
                checksum = 0
                for name in names:
                    values = file["designs"][name][number * BLOCK : (number + 1) * BLOCK]
                    checksum = zlib.crc32(values.tobytes(), checksum)
                assert checksum == int(self.seen[number]) & 0xFFFFFFFF, f"block {number}"

    def rows(self):
        """Some designs of each committed block."""
        committed = np.flatnonzero(self.seen)
        rows = (committed[:, np.newaxis] * BLOCK + [0, self.chance.randrange(BLOCK), BLOCK - 1]).ravel()
        return rows[rows < N_DESIGNS]

    def assert_right(self, status, crank, variance):
        """Columns of the committed rows."""
        rows = self.rows()
        assert np.all(status[rows] == 1)
        np.testing.assert_allclose(crank[rows], 60 + rows * (70 / (N_DESIGNS - 1)), rtol=1e-14)  # three roundings
        assert np.all(variance[rows] > 0)

    def pandas(self):
        frame = pd.read_hdf(self.path)
        assert len(frame) == N_DESIGNS
        self.assert_right(*(frame[name].to_numpy() for name in ("status", "crank", "rocker_velocity_variance")))

    def xarray(self):
        import xarray

        with xarray.open_dataset(self.path, group="designs", engine="h5netcdf", phony_dims="sort") as data:
            self.assert_right(*(data[name].to_numpy() for name in ("status", "crank", "rocker_velocity_variance")))

    def product(self):
        """Gives only committed designs, at least those committed before the call."""
        results = explore.open_results(self.path)
        known = self.rows()
        assert results.n_committed >= BLOCK * np.count_nonzero(self.seen) - 1000
        number = self.chance.randrange(N_DESIGNS)
        if self.seen[number // BLOCK]:
            assert results.design(number)["status"] == 1
        if self.opens % 25 == 0:
            frame = results.to_pandas(["status", "crank"])
            assert len(frame) == results.n_committed
            assert np.all(frame["status"] == 1)
            assert frame.index.is_monotonic_increasing
            assert frame.index.isin(known).sum() == len(set(known.tolist()))


@contextlib.contextmanager
def running(*arguments, folder):
    """A process that ends with the test."""
    process = start(*arguments, folder=folder)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def watch(folder, name):
    """Open the file of a sweep until it ends; return the watcher and the output of `show` and `rank`."""
    path, commands = folder / name, []
    with running("sweep", "study.toml", "-o", name, "--workers", "1", "--quiet", folder=folder) as sweep:
        while not path.exists():
            assert sweep.poll() is None, sweep.communicate()
            time.sleep(0.01)
        watcher = Watcher(path)
        asking = [("show", name, "--json"), ("rank", name, "--json"), ("show", name), ("rank", name)]
        busy = None
        while sweep.poll() is None:
            watcher.open()
            if busy is None and len(commands) < len(asking) and watcher.opens > 100 * len(commands):
                busy = start(*asking[len(commands)], folder=folder)
            elif busy is not None and busy.poll() is not None:
                commands.append((asking[len(commands)], busy.returncode, *busy.communicate()))
                busy = None
        if busy is not None:
            busy.communicate()
        _, errors = sweep.communicate()
    assert (sweep.returncode, errors) == (0, "")
    for _ in range(2):
        watcher.h5py()
    assert np.all(watcher.seen != 0)
    return watcher, commands


def test_readers_of_running_sweeps(tmp_path):
    pytest.importorskip("tables")
    pytest.importorskip("h5netcdf")
    (tmp_path / "study.toml").write_text(STUDY)
    opens = early = 0
    finished = []
    for number in range(SWEEPS):
        if opens >= OPENS and early >= OPENS // 2:
            break
        watcher, commands = watch(tmp_path, f"{number}.h5")
        opens, early, finished = opens + watcher.opens, early + watcher.early, finished + commands
        Path(watcher.path).unlink()
    sys.stdout.write(f"{opens} opens, {early} between the first and the last commit, {len(finished)} commands\n")
    assert opens >= OPENS
    assert early >= OPENS // 2
    assert len(finished) >= 2
    for command, code, out, errors in finished:
        assert code == 0, (command, errors)
        if command[0] == "show" and "--json" in command:
            record = json.loads(out)
            assert record["counts"] == ({"ok": record["committed"]} if record["committed"] else {})
            whole = record["committed"] % BLOCK in (0, N_DESIGNS % BLOCK)
            assert whole, "a block is committed as a whole"
        elif command[0] == "rank" and "--json" in command and out.strip() != "[]":
            assert json.loads(out)[0]["status"] == 1
