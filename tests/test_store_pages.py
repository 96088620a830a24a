"""A power cut during a write may garble whole sectors, so later writes share no page with bytes written before."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from store_files import ATTRIBUTES, COLUMNS, values

from explore.model.columns import Column
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.journal import Journal
from explore.results.store.layout import PAGE
from explore.results.store.memory_file import build_memory_file
from explore.results.store.open_results import open_results
from explore.results.store.packing import pack

REFERENCE = Path(__file__).parent / "reference"
#: Rows of a block in a sweep.
BLOCK = 65_536
MANY = tuple(
    Column(f"metric_{i}", "mm", f"metric number {i}", "metric", ("<f8", "<i4", "|i1")[i % 3]) for i in range(60)
)


def pages(start: int, length: int) -> set[int]:
    return set(range(start // PAGE, -(-(start + length) // PAGE)))


@pytest.mark.parametrize("columns", [COLUMNS[:2], COLUMNS, (*COLUMNS, *MANY)], ids=["two", "six", "many"])
@pytest.mark.parametrize("n_designs", [1, 511, 513, 4095, 4097, BLOCK + 1, 3 * BLOCK])
def test_values_and_commit_words_share_no_page_with_anything_else(n_designs, columns):
    memory_file = build_memory_file(columns, n_designs, BLOCK, ATTRIBUTES | {"config": "text " * 20_000})
    structures = set().union(*(pages(offset, len(piece)) for offset, piece in memory_file.pieces if any(piece)))
    with h5py.File(memory_file, "r") as file:
        commit = file["progress/commit"]
        datasets = [*file["designs"].values(), commit]
        spans = [pages(dataset.id.get_offset(), dataset.nbytes) for dataset in datasets]
        assert commit.shape == (-(-n_designs // BLOCK), PAGE // 8)
        assert commit.id.get_offset() % PAGE == 0
    assert not structures & set().union(*spans)
    assert sum(map(len, spans)) == len(set().union(*spans))
    # Blocks share no page either: each begins on a new one, whatever the type of the column.
    assert all(BLOCK * np.dtype(column.dtype).itemsize % PAGE == 0 for column in columns)


def test_a_file_of_format_1_is_read_continued_and_packed(tmp_path):
    """Its commit words are contiguous."""
    path = tmp_path / "old.h5"
    shutil.copy(REFERENCE / "results_format_1.h5", path)
    before = open_results(path)
    assert before.n_committed == 6
    np.testing.assert_array_equal(before.to_pandas().index, [0, 1, 2, 3, 8, 9])
    with AllDesignsWriter(path, COLUMNS, 10, 4, ATTRIBUTES) as writer:
        assert list(writer.pending) == [1]
        writer.commit(1, values(1, 4, 10))
    results = open_results(path)
    assert results.is_complete
    assert results.verify() == []
    pack(path, tmp_path / "packed.h5")
    expected = np.concatenate([values(number, 4, 10)["rocker_velocity_max"] for number in range(3)])
    for name in ("old.h5", "packed.h5"):
        np.testing.assert_array_equal(open_results(tmp_path / name).to_pandas()["rocker_velocity_max"], expected)


def test_a_journal_of_format_1_is_read_and_continued(tmp_path):
    path = tmp_path / "old.journal"
    shutil.copy(REFERENCE / "journal_format_1.journal", path)
    header = {"determines": "{}", "kernel": "four-bar 1"}
    with Journal(path, header) as journal:
        assert [meta["block"] for meta, _ in journal.records()] == [0, 1, 2]
        journal.append({"block": 3}, {"design": np.arange(12, 16)})
    with Journal(path, header) as journal:
        assert [meta["block"] for meta, _ in journal.records()] == [0, 1, 2, 3]
        np.testing.assert_array_equal(list(journal.records())[1][1]["cv"], np.sqrt(np.arange(4.0) + 1))


def test_records_of_a_journal_begin_on_pages_of_their_own(tmp_path):
    path = tmp_path / "new.journal"
    ends = []
    with Journal(path, {"determines": "{}"}) as journal:
        for number in range(4):
            ends.append(path.stat().st_size)
            journal.append({"block": number}, {"design": np.arange(600 * number)})
    content = path.read_bytes()
    for end in ends:  # of the file before a record was written: the page of the record begins later
        begin = -(-end // PAGE) * PAGE
        assert not any(content[end:begin])
        assert int.from_bytes(content[begin : begin + 8], "little") > 0


def test_a_copy_that_another_program_laid_out_is_continued(tmp_path):
    """In the copy, HDF5's structures may follow a column directly, so only values and commit words are written."""
    path, copy = tmp_path / "grid.h5", tmp_path / "copy.h5"
    with AllDesignsWriter(path, COLUMNS, 1000, 400, ATTRIBUTES) as writer:
        writer.commit(0, values(0, 400, 1000))
    with h5py.File(path) as source, h5py.File(copy, "w") as target:
        for name, value in source.attrs.items():
            target.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)
        for group in source.values():
            source.copy(group, target)
    with AllDesignsWriter(copy, COLUMNS, 1000, 400, ATTRIBUTES) as writer:
        assert list(writer.pending) == [1, 2]
        for number in (2, 1):
            writer.commit(number, values(number, 400, 1000))
    results = open_results(copy)
    assert results.is_complete
    assert results.verify() == []
