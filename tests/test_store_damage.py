"""Damaged files: each is refused with a clear error, or its sound part is read."""

import os

import h5py
import numpy as np
import pytest
from store_files import BLOCK, N_DESIGNS, assert_random_damage_is_told

from explore.base.errors import ResultsError
from explore.results.store.open_results import open_results


def test_missing_file(tmp_path):
    with pytest.raises(ResultsError, match=r"missing.h5 does not exist; sweep its study first"):
        open_results(tmp_path / "missing.h5")


@pytest.mark.parametrize("content", [b"", b"a,b\n1,2\n", b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" + bytes(500)])
def test_files_that_are_not_hdf5(tmp_path, content):
    path = tmp_path / "text.h5"
    path.write_bytes(content)
    with pytest.raises(ResultsError, match=r"text\.h5 is (not an HDF5 file|damaged|cut short)"):
        open_results(path)


@pytest.mark.parametrize("kind", ["copy", "packed_copy"])
def test_file_cut_anywhere(kind, request):
    copy = request.getfixturevalue(kind)
    whole = copy.read_bytes()
    for share in np.linspace(0, 1, 40, endpoint=False):
        copy.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(ResultsError, match=r"not an HDF5 file|cut short|damaged"):
            open_results(copy)
    copy.write_bytes(whole[:-1])
    with pytest.raises(ResultsError, match="cut short"):
        open_results(copy)


def test_file_cut_or_replaced_after_opening(copy, finished):
    results = open_results(copy)
    os.truncate(copy, 20_000)
    with pytest.raises(ResultsError, match="cut short"):
        results.to_pandas()
    other = copy.with_name("other.h5")
    other.write_bytes(finished.read_bytes())
    other.replace(copy)
    with pytest.raises(ResultsError, match="was replaced"):
        results.to_pandas()
    copy.unlink()
    with pytest.raises(ResultsError, match="was removed"):
        results.to_pandas()


def test_foreign_hdf5(tmp_path):
    path = tmp_path / "foreign.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(3)
    with pytest.raises(ResultsError, match="not one written by explore"):
        open_results(path)


def test_newer_version(copy):
    with h5py.File(copy, "r+") as file:
        file.attrs["format_version"] = 4
    with pytest.raises(ResultsError, match=r"format version 4.*newer explore; update"):
        open_results(copy)


def chunked_column(file: h5py.File) -> None:
    del file["designs/crank"]
    file["designs"].create_dataset("crank", (N_DESIGNS,), "<f8", chunks=(BLOCK,))


HOSTILE = {
    "n_designs smaller": lambda file: file.attrs.modify("n_designs", 10),
    "n_designs negative": lambda file: file.attrs.modify("n_designs", -1),
    "n_designs is a text": lambda file: file.attrs.create("n_designs", "many"),
    "block_size zero": lambda file: file.attrs.modify("block_size", 0),
    "block_size smaller": lambda file: file.attrs.modify("block_size", 1),
    "no columns": lambda file: file.__delitem__("designs"),
    "no index": lambda file: file["designs"].__delitem__("design"),
    "no commit words": lambda file: file.__delitem__("progress/commit"),
    "no names": lambda file: file.__delitem__("frame/axis0"),
    "the same name twice": lambda file: file["frame/axis0"].write_direct(file["frame/axis0"][:][[0, 0, 2, 3, 4]]),
    "one column more": lambda file: file["designs"].create_dataset("more", data=np.zeros(3)),
    "labels are no JSON": lambda file: file["designs/status"].attrs.create("labels", "{"),
    "labels are a list": lambda file: file["designs/status"].attrs.create("labels", "[1]"),
    "a chunked column": chunked_column,
}


@pytest.mark.parametrize("change", HOSTILE.values(), ids=HOSTILE)
def test_hostile_headers_are_refused(copy, change):
    with h5py.File(copy, "r+") as file:
        change(file)
    with pytest.raises(ResultsError, match=r"copy\.h5 is damaged"):
        open_results(copy)


def test_random_damage_never_gives_another_error(copy):
    structures = range(4096)  # the columns start behind them
    assert_random_damage_is_told(copy, structures, lambda: open_results(copy).counts)
