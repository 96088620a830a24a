"""The layout of a results file and its readers."""

import io
import json
import math
import random

import h5py
import numpy as np
import pandas as pd
import pytest
from store_files import ATTRIBUTES, BLOCK, COLUMNS, LABELS, N_BLOCKS, N_DESIGNS, fill, flip, values

import explore
from explore.base.errors import ResultsError
from explore.model.columns import Column
from explore.results.store.creation import create_results_file
from explore.results.store.memory_file import MemoryFile
from explore.results.store.open_results import open_results
from explore.results.store.study_record import _FORMS


def test_layout_is_what_other_programs_need(finished):
    with h5py.File(finished) as file:
        assert dict(file.attrs) == {
            **{name: v.encode() if isinstance(v, str) else v for name, v in ATTRIBUTES.items()},
            "format": b"explore-results",
            "format_version": 3,
            "n_designs": N_DESIGNS,
            "block_size": BLOCK,
            "commit_offset": file["progress/commit"].id.get_offset(),
            "checked": file.attrs["checked"],
        }
        assert set(file) == {"designs", "frame", "progress"}
        assert file["progress/commit"].shape == (N_BLOCKS, 512)
        for column in COLUMNS:
            dataset = file["designs"][column.name]
            assert (dataset.dtype.str, dataset.shape) == (column.dtype, (N_DESIGNS,))
            assert dataset.chunks is None
            assert dataset.id.get_offset() % 4096 == 0
            assert dataset.attrs["units"].decode() == column.unit
            assert dataset.attrs["long_name"].decode() == column.long_name
            assert dataset.attrs["role"].decode() == column.role
        labels = json.loads(file["designs/status"].attrs["labels"])
        assert labels["0"] == "pending"
        assert labels == {str(code): label for code, label in LABELS.items()}
        assert "labels" not in file["designs/crank"].attrs
        # the pandas view adds no data: the same objects under other names
        assert file["frame/axis1"] == file["designs/design"]
        assert file["frame/block0_values"] == file["designs/crank"]
    assert finished.read_bytes()[8] == 0, "superblock 0, which the oldest readers know"


def test_results_give_everything_back(finished):
    results = open_results(str(finished))
    assert results.columns == COLUMNS
    assert results.config == ATTRIBUTES["config"]
    assert results.attributes["seed"] == 1
    assert results.units["crank"] == "mm"
    assert results.is_complete
    assert (results.n_designs, results.n_committed, len(results)) == (N_DESIGNS,) * 3
    blocked = len(range(3, N_DESIGNS, 7))
    assert results.counts == {"ok": N_DESIGNS - blocked, "crank_blocked": blocked}
    frame = results.to_pandas()
    expected = pd.concat([pd.DataFrame(values(number)) for number in range(N_BLOCKS)], ignore_index=True)
    expected["feasible"] = expected["feasible"] != 0
    expected.index.name = "design"
    pd.testing.assert_frame_equal(frame, expected, check_exact=True)
    row = results.design(3)
    assert {**row, "rocker_velocity_max": None} == {
        "design": 3, "crank": 3.25, "rocker_velocity_max": None, "nodes": 3, "status": 3, "feasible": True,
    }  # fmt: skip
    assert np.isnan(row["rocker_velocity_max"])
    reports = []
    assert results.verify(lambda *state: reports.append(state)) == []
    assert reports == [(done, N_BLOCKS) for done in range(1, N_BLOCKS + 1)]
    assert (results.keep, results.n_studied, results.is_packed) == ("all", N_DESIGNS, False)
    assert results.count_statuses([0]) == {"ok": BLOCK - 143, "crank_blocked": 143}


def test_a_path_may_be_text(finished):
    assert len(explore.Results(str(finished))) == N_DESIGNS


def test_part_of_the_columns_and_blocks_in_order(finished):
    results = open_results(finished)
    assert list(results.to_pandas(["nodes", "design", "crank"])) == ["nodes", "crank"]
    blocks = list(results.blocks(["design", "feasible"]))
    assert [len(block["design"]) for block in blocks] == [BLOCK] * 9 + [500]
    np.testing.assert_array_equal(np.concatenate([b["design"] for b in blocks]), np.arange(N_DESIGNS))
    assert blocks[0]["feasible"].dtype == bool
    assert set(next(results.blocks())) == {column.name for column in COLUMNS}


@pytest.mark.parametrize("numbers", [[], [9499], [7, 3, 3, 9000, 4, 2999, 3001], range(N_DESIGNS)[::-1]])
def test_single_rows_in_the_requested_order(finished, numbers):
    results = open_results(finished)
    expected = results.to_pandas().loc[list(numbers)]
    pd.testing.assert_frame_equal(results.designs(list(numbers)), expected, check_exact=True)


def test_only_committed_rows_are_given(tmp_path):
    path = fill(tmp_path / "part.h5", [8, 2, 3, 9])
    results = open_results(path)
    rows = np.r_[2000:4000, 8000:9500]
    assert not results.is_complete
    assert results.n_committed == 3500
    np.testing.assert_array_equal(results.to_pandas().index, rows)
    np.testing.assert_array_equal(results.to_pandas(["crank"])["crank"], rows + 0.25)
    assert sum(results.counts.values()) == 3500
    with pytest.raises(ResultsError, match="design 1999 is not computed yet"):
        results.design(1999)
    with pytest.raises(ResultsError, match="design 7000 is not computed yet"):
        results.designs([2000, 7000])


def test_nothing_committed_is_an_empty_table(tmp_path):
    results = open_results(fill(tmp_path / "none.h5", []))
    assert results.to_pandas().shape == (0, len(COLUMNS) - 1)
    assert results.to_pandas()["feasible"].dtype == bool
    assert results.counts == {}


def test_wrong_names_and_numbers_say_what_to_do(finished):
    results = open_results(finished)
    with pytest.raises(ResultsError, match="no column 'cranc'; did you mean 'crank'"):
        results.to_pandas(["cranc"])
    for number in (-1, N_DESIGNS):
        with pytest.raises(ResultsError, match=f"no design {number}: they are numbered 0 to 9,499"):
            results.design(number)
        with pytest.raises(ResultsError, match=f"no design {number}: they are numbered 0 to 9,499"):
            results.designs([3, number, 5])


def test_pandas_reads_it_without_a_key(finished):
    pytest.importorskip("tables")
    frame = pd.read_hdf(finished)
    ours = open_results(finished).to_pandas()
    ours["feasible"] = ours["feasible"].astype("i1")  # PyTables reads HDF5's booleans as numbers too
    pd.testing.assert_frame_equal(frame, ours, check_exact=True)


def test_xarray_reads_columns_with_units(finished):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with xarray.open_dataset(finished, group="designs", engine="h5netcdf", phony_dims="sort") as data:
        assert data["crank"].attrs["units"] == "mm"
        assert data["rocker_velocity_max"].attrs["long_name"] == "greatest velocity ω"
        for number, name in ((0, "nodes"), (5, "status")):
            start = number * BLOCK
            np.testing.assert_array_equal(data[name][start : start + BLOCK], values(number)[name])


@pytest.mark.parametrize("length", [59_999, 60_001, 300_000])
def test_long_texts_are_kept(tmp_path, length):
    path = tmp_path / "long.h5"
    text = "ω" + "x" * (length - 2)  # the letter takes two bytes: the limit counts bytes
    create_results_file(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES | {"config": text})
    assert open_results(path).config == text
    with h5py.File(path) as file:
        assert ("study" in file) == (length > 60_000)


def test_image_behaves_like_a_file():
    """Random writes and reads against an ordinary file in memory, which keeps every byte."""
    chance = random.Random(3)
    memory_file, plain = MemoryFile(), io.BytesIO()
    for _ in range(200):
        place, length = chance.randrange(500), chance.randrange(1, 60)
        for file in (memory_file, plain):
            file.seek(place)
        if chance.random() < 0.5:
            data = chance.randbytes(length)
            assert memory_file.write(data) == plain.write(data)
        else:
            from_image, from_plain = bytearray(length), bytearray(length)
            memory_file.readinto(from_image)
            plain.readinto(from_plain)  # leaves zeros beyond the end, which the other fills in
            assert from_image == from_plain
    assert memory_file.seek(0, io.SEEK_END) == plain.seek(0, io.SEEK_END) == memory_file.tell()


def test_create_refuses_nonsense(tmp_path):
    for columns, n_designs in (
        (COLUMNS[1:], 5), (COLUMNS[:1], 5), (COLUMNS + COLUMNS[1:2], 5), (COLUMNS, 0),
        ((*COLUMNS, Column("a/b", "", "", "metric")), 5),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"column|design"):
            create_results_file(tmp_path / "x.h5", columns, n_designs, BLOCK, ATTRIBUTES)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("row", [4 * BLOCK, 5 * BLOCK - 1], ids=["first", "last"])
def test_a_committed_block_without_its_rows_is_damaged(copy, row):
    """Rows that were never written read as zeros, and take no space on the disk."""
    with h5py.File(copy, "r+") as file:
        file["designs/design"][row] = 0
    with pytest.raises(ResultsError, match="is damaged: rows 4000 to 4999 are marked as committed, but were"):
        open_results(copy).to_pandas()


def test_designs_of_a_damaged_block_are_refused(copy):
    """One flipped bit in the last crank of block 3: its designs are refused by number, all others are read."""
    offset = open_results(copy)._layout.offset(open_results(copy).columns[1], 4 * BLOCK - 1)
    flip(copy, offset)
    results = open_results(copy)
    assert results.verify() == [3]
    message = f"rows {3 * BLOCK} to {4 * BLOCK - 1} do not have the checksum .*; `explore verify` lists"
    for read in (lambda: results.design(3 * BLOCK), lambda: results.designs([0, 3 * BLOCK + 1])):
        with pytest.raises(ResultsError, match=message):
            read()
    assert results.design(4 * BLOCK)["design"] == 4 * BLOCK
    assert results.designs([0, 5]).index.tolist() == [0, 5]
    others = [number for number in range(N_DESIGNS) if number // BLOCK != 3]
    assert results.designs(others).index.tolist() == others


def test_results_and_studies_show_themselves_in_words(tmp_path):
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={"crank": [60, 2000], "coupler": 900, "rocker": 660, "ground": 650},
        metrics=["swing_angle", "linkage_class"],
    )
    results = explore.sweep(study, tmp_path / "two <cranks>.h5")
    shown = results._repr_html_()
    assert "two &lt;cranks&gt;.h5" in shown
    assert "1 ok, 1 cannot_assemble" in shown or "1 ok, 1 crank_blocked" in shown
    assert "<td>ok</td>" in shown
    assert "<td>crank-rocker</td>" in shown or "<td>crank_rocker</td>" in shown
    text = study._repr_html_()
    assert "study of 2 designs, grid; swept: crank</p>" in text
    assert "crank = [60, 2000]" in text

    table = results.to_pandas()
    words = explore.in_words(table)
    assert list(words["status"]) == [table.attrs["labels"]["status"][code] for code in table["status"]]
    assert (words["status"] == "ok").tolist() == (table["status"] == 1).tolist() == [True, False]
    assert set(words["status"].cat.categories) == set(table.attrs["labels"]["status"].values())
    assert words["feasible"].dtype == bool
    with pytest.raises(explore.RequestError, match="has no attrs"):
        explore.in_words(pd.DataFrame({"status": [1]}))


WINDOW = {"from": 0, "to": 90.0}
STUDY = {
    "constraints": {"cv": {"min": None, "max": 1.5}}, "evaluate": {"drive": "crank", "window": WINDOW}, "points": ["M"],
}  # fmt: skip
#: What attributes of a file hold, and what they do not.
FORMS = {
    "objectives": (["cv"], [["cv", 1], {"cv": "min"}, "cv", 1]),
    "senses": ({"cv": "min", "mean": None}, [{"cv": "least"}, ["min"]]),
    "speed_powers": ({"cv": 0, "mean": 1.0, "error": None}, [{"cv": "1"}, {"cv": True}, [1]]),
    "status_sentences": ({"1": "ok"}, [{"1": 1}, ["ok"]]),
    "label_sentences": ({"1": "ok"}, [{"1": 1}, ["ok"]]),
    "studied_counts": ({"ok": 1}, [{"ok": 1.0}, {"ok": True}, [1]]),
    "tally": ({"ok": 1, "missed": [1], "of": {}}, [{"ok": "x"}, {"ok": None}, [1]]),
    "determines": (
        STUDY,
        [
            [STUDY],
            *(STUDY | {"constraints": {"cv": sides}} for sides in ([1, 2], {"min": 1}, {"min": "1", "max": None})),
            *(STUDY | {"constraints": {"cv": {"min": math.inf, "max": end}}} for end in (None, 10**400, True)),
            *(STUDY | {"evaluate": evaluate} for evaluate in ([], {"drive": 1}, {"window": 1}, {"window": ["cycle"]})),
            *(STUDY | {"evaluate": {"window": WINDOW | end}} for end in ({"to": -1}, {"to": True}, {"too": 1})),
            STUDY | {"points": "M"}, STUDY | {"points": [1]},
        ],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", _FORMS)
def test_attributes_of_another_form_are_told(name):
    good, others = FORMS[name]
    assert _FORMS[name](good)
    assert [other for other in others if _FORMS[name](other)] == []
