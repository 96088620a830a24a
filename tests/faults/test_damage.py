"""Damaged bytes, changed studies, and blocks in any order."""

import random
import shutil

import h5py
import numpy as np
import pytest
from command_line import call

from explore.results.store.open_results import open_results
from faults.checker import check, sha256
from faults.content import BLOCK, COLUMNS, N_BLOCKS, rows
from faults.sweeps import study, sweep_here


@pytest.fixture
def copy(fresh, undisturbed):
    """A copy of the complete file."""
    return shutil.copy(undisturbed, fresh() / "grid.h5")


@pytest.mark.parametrize("trials", [20, pytest.param(1000, marks=pytest.mark.slow)])
def test_one_flipped_bit_costs_one_block(server, copy, whole, figures, trials):
    chance = random.Random(9)
    with h5py.File(copy) as file:
        offsets = {column.name: file["designs"][column.name].id.get_offset() for column in COLUMNS}
    for _ in range(trials):
        number, column = chance.randrange(N_BLOCKS), chance.choice(COLUMNS)
        size = np.dtype(column.dtype).itemsize
        place = offsets[column.name] + number * BLOCK * size + chance.randrange(len(rows(number)) * size)
        with copy.open("r+b") as file:
            file.seek(place)
            byte = file.read(1)[0]
            file.seek(place)
            file.write(bytes([byte ^ 1 << chance.randrange(8)]))
        assert figures.count(check(copy)).detected == {number}
        assert open_results(copy).verify() == [number]
        again = server.write(copy)
        assert (again.code, again.numbers("run")) == (0, [number])
        figures["redone"] += 1
        assert sha256(copy) == whole


def test_changed_study_is_refused_and_the_file_untouched(tmp_path, figures):
    config, path = study(tmp_path, 7), tmp_path / "grid.h5"
    sweep_here(config, path)
    before = path.read_bytes(), path.stat().st_mtime_ns
    code, _, stderr = call("sweep", study(tmp_path, 8), "-o", path, "--quiet")
    assert code == 1
    assert stderr.startswith(f"error: {path} holds the results of another study; what changed:\n")
    assert "  parameters.crank.num: 7 -> 8\n" in stderr
    assert stderr.endswith("use --restart to start over, or name another file with -o\n")
    assert (path.read_bytes(), path.stat().st_mtime_ns) == before
    assert sorted(file.name for file in tmp_path.glob("grid.h5*")) == ["grid.h5", "grid.h5.log.jsonl"]
    figures["trials"] += 1
