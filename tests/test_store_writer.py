"""The writer: the same bytes after any interruption, and files of one study only."""

import json
import random
import time

import h5py
import numpy as np
import pandas as pd
import pytest
from store_files import (
    ATTRIBUTES,
    BLOCK,
    COLUMNS,
    N_BLOCKS,
    N_DESIGNS,
    assert_block_has_its_values,
    fill,
    flip,
    sha256,
    values,
    writer,
)

from explore.base.errors import ResultsError
from explore.model.status import Status
from explore.results.store import system_calls
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.block_bytes import commit_word
from explore.results.store.creation import create_results_file
from explore.results.store.layout import PAGE
from explore.results.store.layout_reader import read_layout
from explore.results.store.open_results import open_results


def test_bytes_do_not_depend_on_order_or_time(finished, tmp_path):
    time.sleep(1.1)  # HDF5 would keep times in seconds
    for name, order in (("back.h5", range(N_BLOCKS)[::-1]), ("mixed.h5", random.Random(2).sample(range(10), 10))):
        assert sha256(fill(tmp_path / name, order)) == sha256(finished)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["back.h5", "mixed.h5"], "no lock or part file stays"


def test_hdf5_metadata_never_changes(tmp_path):
    """Only bytes of the columns and the commit words change after the file is created."""
    path = tmp_path / "grid.h5"
    create_results_file(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES)
    before = np.frombuffer(path.read_bytes(), np.uint8)
    fill(path)
    after = np.frombuffer(path.read_bytes(), np.uint8)
    is_value = np.zeros(len(before), bool)
    with h5py.File(path) as file:
        for dataset in (*file["designs"].values(), file["progress/commit"]):
            start = dataset.id.get_offset()
            is_value[start : start + dataset.nbytes] = True
    assert np.any(before != after)
    assert not np.any((before != after) & ~is_value)


def test_damaged_block_is_pending_again(copy):
    with h5py.File(copy) as file:
        offsets = [file["designs"][name].id.get_offset() for name in ("design", "nodes", "feasible")]
        commit = file["progress/commit"].id.get_offset()
    original = sha256(copy)
    for number, (offset, size) in zip((1, 4, 9), zip(offsets, (8, 4, 1), strict=True), strict=True):
        flip(copy, offset + (number * BLOCK + 17) * size)
    flip(copy, commit + PAGE * 6)
    assert open_results(copy).verify() == [1, 4, 6, 9]
    with writer(copy) as store:
        assert list(store.pending) == store.damaged == [1, 4, 6, 9]
        assert store.n_pending == 4
        assert open_results(copy).n_committed == N_DESIGNS - 3500, "readers no longer see them either"
        for number in store.pending:
            store.commit(number, values(number))
    assert sha256(copy) == original


def test_pending_blocks_are_plain_numbers(tmp_path):
    """The sweep iterates over them, makes sets of them and asks whether there are any."""
    with writer(tmp_path / "grid.h5") as store:
        assert store.damaged == []
        assert all(type(number) is int for number in store.pending)
        before = store.pending
        for number in before:
            assert store.pending
            store.commit(number, values(number))
        assert len(before) == N_BLOCKS
        assert (store.n_pending, len(store.pending), bool(store.pending)) == (0, 0, False)


def test_reading_while_writing(tmp_path):
    pytest.importorskip("tables")
    path = tmp_path / "grid.h5"
    with writer(path) as store:
        opened_before = open_results(path)
        for done, number in enumerate([3, 0, 7], 1):
            store.commit(number, values(number))
            assert open_results(path).n_committed == done * BLOCK == store.n_committed
            assert_block_has_its_values(path, number)
            frame = pd.read_hdf(path)
            assert int((frame["status"] != Status.PENDING).sum()) == done * BLOCK
        assert opened_before.n_committed == 0, "Results has the blocks committed when the file was opened"
        assert list(store.pending) == [1, 2, 4, 5, 6, 8, 9]


def test_commit_takes_exactly_what_was_declared(tmp_path):
    path = tmp_path / "grid.h5"
    with writer(path) as store:
        store.commit(0, values(0))
        good = values(1)
        before = sha256(path)
        wrong = {
            "not pending": (0, values(0)),
            "not pending ": (N_BLOCKS, good),
            "crank has": (1, good | {"crank": good["crank"].astype("f4")}),
            "nodes has": (1, good | {"nodes": good["nodes"][:-1]}),
            "'speed'": (1, good | {"speed": good["crank"]}),
            "'status'": (1, {name: v for name, v in good.items() if name != "status"}),
            "its designs are 1000 to 1999": (1, good | {"design": np.arange(BLOCK)}),
            "its designs are 1000 to 1999 ": (1, good | {"design": np.r_[1000:1500, 1501:2001]}),
        }
        for text, (number, columns) in wrong.items():
            with pytest.raises(ValueError, match=text.strip()):
                store.commit(number, columns)
        assert sha256(path) == before
        store.commit(1, good | {"crank": np.repeat(good["crank"], 2)[::2], "design": np.arange(1000, 2000)})
    assert_block_has_its_values(path, 1)


CHANGED = {"mechanism": "crank-rocker", "parameters": {"crank": [1, 5], "speed": 2}}


@pytest.mark.parametrize(
    ("changes", "lines"),
    [
        (
            {"request_sha256": "cd" * 32, "determines": json.dumps(CHANGED)},
            [
                "parameters.crank: [1, 2] -> [1, 5]",
                "parameters.ground: 3 -> (not there)",
                "parameters.speed: (not there) -> 2",
            ],
        ),
        ({"kernel": "four-bar 2"}, ['kernel: "four-bar 1" -> "four-bar 2"']),
    ],
)
def test_changed_study_is_refused_with_a_diff(copy, changes, lines):
    before = sha256(copy)
    with pytest.raises(ResultsError) as refusal, writer(copy, attributes=changes):
        pytest.fail("a changed study was accepted")
    text = str(refusal.value).splitlines()
    assert [line.strip() for line in text[1:-1]] == lines
    assert text[-1] == "use `restart=True` to start over, or name another file with `path`"
    assert sha256(copy) == before
    fill(copy, [])  # the lock was released


def test_changed_size_is_refused(copy):
    with (
        pytest.raises(ResultsError, match="designs: 9500 -> 9501"),
        AllDesignsWriter(copy, COLUMNS, 9501, BLOCK, ATTRIBUTES),
    ):
        pytest.fail("a changed size was accepted")


def test_restart_moves_the_old_file_aside(copy):
    before = sha256(copy)
    for moved in ("copy.h5.old", "copy.h5.old2"):
        with writer(copy, restart=True) as store:
            assert list(store.pending) == list(range(N_BLOCKS))
            assert copy.with_name(moved).exists()
    assert sha256(copy.with_name("copy.h5.old")) == before


def test_restart_over_a_file_that_is_no_results_file(tmp_path):
    path = tmp_path / "notes.h5"
    path.write_text("my notes")
    (tmp_path / "folder.h5").mkdir()
    with pytest.raises(ResultsError, match="not an HDF5 file; name another file"):
        fill(path)
    for other in (path, tmp_path / "folder.h5"):
        with pytest.raises(ResultsError, match="left alone"), writer(other, restart=True):
            pass
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder.h5", "notes.h5"]
    assert path.read_text() == "my notes"


def test_the_checksum_of_a_block_covers_every_byte_of_every_column():
    """Columns as long as those of a sweep: half a megabyte each."""
    columns = [np.arange(65_536.0), np.arange(65_536, dtype="<i4"), np.zeros(65_536, "|i1")]
    word = commit_word(columns)
    for position, column in enumerate(columns):
        for byte in (0, column.nbytes // 2, column.nbytes - 1):
            changed = [values.copy() for values in columns]
            changed[position].view(np.uint8)[byte] ^= 1
            assert commit_word(changed) != word


def test_a_block_is_durable_before_its_word(tmp_path, monkeypatch):
    """After a power cut a commit word must not be there without the values of its block."""
    path, steps = tmp_path / "grid.h5", []
    with writer(path) as store:
        first_word = read_layout(path).commit_offset
        write_at, sync_data = system_calls.write_at, system_calls.sync_data

        def write(descriptor, data, offset):
            steps.append("word" if offset >= first_word else "values")
            write_at(descriptor, data, offset)

        def sync(descriptor):
            steps.append("sync")
            sync_data(descriptor)

        monkeypatch.setattr(system_calls, "write_at", write)
        monkeypatch.setattr(system_calls, "sync_data", sync)
        store.commit(0, values(0))
    assert steps == ["values"] * len(COLUMNS) + ["sync", "word", "sync"]


def test_the_last_block_writes_the_padding_of_its_pages(finished, tmp_path):
    """A power cut during that block may have garbled it."""
    path = fill(tmp_path / "grid.h5", range(N_BLOCKS - 1))
    layout = read_layout(path)
    with path.open("r+b") as file:
        for column in layout.columns:
            assert layout.padding(column) > 0
            file.seek(layout.offset(column, N_DESIGNS))
            file.write(b"x" * layout.padding(column))
    fill(path, [N_BLOCKS - 1])
    assert sha256(path) == sha256(finished)


def test_a_page_that_holds_more_than_its_word_stands_for_no_block(copy):
    """A power cut while the word was written may have garbled its page."""
    flip(copy, read_layout(copy).word_offset(3) + PAGE - 1)
    results = open_results(copy)
    assert results.verify() == [3]
    assert results.n_committed == N_DESIGNS - BLOCK
