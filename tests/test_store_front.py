"""Results files that keep the Pareto-optimal designs only."""

import json
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from store_files import ATTRIBUTES, BLOCK, COLUMNS, N_DESIGNS, sha256, values

from explore.base.errors import ResultsError
from explore.results.ranking.rankings import RankRequest, rank_source
from explore.results.store import front_writer
from explore.results.store.block_bytes import commit_word
from explore.results.store.front_writer import FrontWriter, write_front
from explore.results.store.open_results import open_results
from explore.results.store.packing import pack

STUDIED = {"ok": 8142, "crank_blocked": 1358, "no_stroke": 0}
KEPT = ATTRIBUTES | {"keep": "front", "studied_designs": N_DESIGNS, "studied_counts": json.dumps(STUDIED)}
LABELS = {label: count for label, count in STUDIED.items() if count}
#: Numbers in several blocks of the study, the first and the last among them.
SOME = [0, 5, 999, 1000, 4321, 4322, 9499]
#: A file of several blocks, the last of them short.
MANY = list(range(1, N_DESIGNS, 3))


def arrays(numbers: list[int]) -> dict[str, np.ndarray]:
    whole = values(0, N_DESIGNS)
    design = np.array(numbers, dtype="<i8")
    return {"design": design} | {name: column[design] for name, column in whole.items()}


def keep(path: Path, numbers: list[int], *, packed: bool = False) -> Path:
    write_front(path, COLUMNS, arrays(numbers), BLOCK, KEPT)
    if not packed:
        return path
    pack(path, path.with_suffix(".packed.h5"))
    return path.with_suffix(".packed.h5")


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("numbers", [[], [17], SOME, MANY], ids=["none", "one", "some", "many"])
def test_everything_comes_back(tmp_path, numbers, packed):
    results = open_results(keep(tmp_path / "kept.h5", numbers, packed=packed))
    expected = pd.DataFrame(arrays(numbers)).set_index("design")
    expected["feasible"] = expected["feasible"] != 0
    pd.testing.assert_frame_equal(results.to_pandas(), expected, check_exact=True)
    assert (results.keep, results.n_designs, results.n_committed, len(results)) == ("front", *[len(numbers)] * 3)
    assert (results.n_studied, results.counts) == (N_DESIGNS, LABELS)
    assert results.is_complete
    assert results.is_packed == packed
    assert results.verify() == []
    assert repr(results).endswith(f": {len(numbers)} kept of 9500 designs>")
    for number in numbers[:: max(1, len(numbers) // 5)]:
        assert results.design(number)["crank"] == number + 0.25
    backwards = numbers[::-1]
    pd.testing.assert_frame_equal(results.designs(backwards), expected.loc[backwards], check_exact=True)
    blocks = [block["design"] for block in results.blocks(["design"])]
    np.testing.assert_array_equal(np.concatenate([*blocks, np.empty(0, "<i8")]), numbers)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("numbers", [[], SOME], ids=["none", "some"])
def test_other_programs_read_it(tmp_path, numbers, packed):
    pytest.importorskip("tables")
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    path = keep(tmp_path / "kept.h5", numbers, packed=packed)
    expected = pd.DataFrame(arrays(numbers)).set_index("design")
    frame = pd.read_hdf(path)
    pd.testing.assert_frame_equal(frame, expected, check_exact=True)
    with xarray.open_dataset(path, group="designs", engine="h5netcdf", phony_dims="sort") as data:
        np.testing.assert_array_equal(data["design"], numbers)
        assert data["nodes"].dtype == np.dtype("<i4")
    with h5py.File(path) as file:
        for name, column in arrays(numbers).items():
            np.testing.assert_array_equal(file["designs"][name][:], column)
            assert file["designs"][name].dtype == column.dtype
        assert (file.attrs["keep"], file.attrs["studied_designs"]) == (b"front", N_DESIGNS)


def test_ranking_of_kept_designs(tmp_path):
    """A file that keeps the front is ranked by its rows; the metric is the root of the design number."""
    request = RankRequest(["rocker_velocity_max:max"])
    ranking = rank_source(open_results(keep(tmp_path / "kept.h5", [9, 40, 81])), request)
    assert ranking.frame.index.tolist() == [81]
    empty = rank_source(open_results(keep(tmp_path / "none.h5", [])), request)
    assert empty.frame.empty


def test_design_that_was_not_kept(tmp_path):
    results = open_results(keep(tmp_path / "kept.h5", SOME))
    for number in (1, 4320, 9498):
        with pytest.raises(ResultsError, match=rf"kept\.h5: design {number} is not Pareto-optimal and was not kept"):
            results.design(number)
        with pytest.raises(ResultsError, match=f"design {number} is not Pareto-optimal"):
            results.designs([5, number, 999])
    for number in (-1, N_DESIGNS):
        with pytest.raises(ResultsError, match=f"has no design {number}: they are numbered 0 to 9,499"):
            results.design(number)


def test_bytes_depend_on_the_content_only(tmp_path):
    first, second = keep(tmp_path / "a.h5", SOME), keep(tmp_path / "b.h5", SOME)
    assert sha256(first) == sha256(second)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5", "b.h5"]


def test_invalid_content_is_an_error(tmp_path):
    good = arrays(SOME)
    for attributes, changes, text in (
        (KEPT, {"design": good["design"][::-1].copy()}, "must ascend"),
        (KEPT, {"design": np.zeros(len(SOME), "<i8")}, "must ascend"),
        (KEPT, {"nodes": good["nodes"].astype("<i8")}, "nodes has"),
        (KEPT, {"crank": good["crank"][1:]}, "crank has"),
        (KEPT, {"speed": good["crank"]}, "'speed'"),
        (ATTRIBUTES, {}, "attribute keep"),
    ):
        with pytest.raises(ValueError, match=text):
            write_front(tmp_path / "kept.h5", COLUMNS, good | changes, BLOCK, attributes)
    with pytest.raises(ResultsError, match=r"the folder .*missing cannot be written|missing.*cannot be created"):
        keep(tmp_path / "missing" / "kept.h5", SOME)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("numbers", "name", "value"),
    [
        ([], "studied_designs", -1), ([], "studied_designs", "many"), ([], "studied_counts", "{"),
        ([], "studied_counts", "[1]"), ([], "studied_counts", '{"ok": "x"}'), ([], "studied_counts", 3),
        ([], "keep", "some"), (SOME, "studied_designs", len(SOME) - 1), (SOME, "keep", "some"),
    ],
)  # fmt: skip
def test_hostile_attributes_are_refused(tmp_path, numbers, name, value):
    path = keep(tmp_path / "kept.h5", numbers)
    with h5py.File(path, "r+") as file:
        file.attrs[name] = value
    with pytest.raises(ResultsError, match=r"kept\.h5 is damaged"):
        open_results(path)
    with h5py.File(path, "r+") as file:
        del file.attrs[name]
    with pytest.raises(ResultsError, match=r"kept\.h5 is damaged"):
        open_results(path)


def test_numbers_that_do_not_ascend(tmp_path):
    path = keep(tmp_path / "kept.h5", SOME)
    with h5py.File(path, "r+") as file:
        file["designs/design"][2] = 3
    results = open_results(path)
    assert results.verify() == [0]
    with pytest.raises(ResultsError, match="rows 0 to .* do not have the checksum"):
        results.design(5)
    with h5py.File(path, "r+") as file:  # with the right checksum
        columns = [file["designs"][column.name][:] for column in results.columns]
        file["progress/commit"][0, 0] = commit_word(columns)
    with pytest.raises(ResultsError, match="is damaged: its design numbers do not ascend"):
        open_results(path).design(5)


def test_bits_of_the_values_are_checked(tmp_path):
    path = keep(tmp_path / "kept.h5", MANY)
    with h5py.File(path, "r+") as file:
        file["designs/nodes"][2 * BLOCK] ^= 1
    assert open_results(path).verify() == [2]


def test_a_finished_file_has_a_durable_name(tmp_path, monkeypatch):
    """The run that renamed it may have been killed before the name was durable."""
    attributes = {key: value for key, value in KEPT.items() if not key.startswith("studied")}
    synchronised = []
    with FrontWriter(tmp_path / "a.h5", COLUMNS, N_DESIGNS, BLOCK, attributes) as first:
        first.finish(arrays(SOME), KEPT)
    monkeypatch.setattr(front_writer, "sync_folder", synchronised.append)
    with FrontWriter(tmp_path / "a.h5", COLUMNS, N_DESIGNS, BLOCK, attributes) as again:
        assert again.is_finished
    assert synchronised == [tmp_path]


@pytest.mark.parametrize("row", [BLOCK, 2 * BLOCK - 1], ids=["first", "last"])
def test_a_block_without_its_rows_is_damaged(tmp_path, row):
    path = keep(tmp_path / "kept.h5", MANY)
    with h5py.File(path, "r+") as file:
        file["designs/design"][row] = 0
    with pytest.raises(ResultsError, match="is damaged: rows 1000 to 1999 are marked as committed, but were"):
        open_results(path).to_pandas()
