"""Results as an xarray dataset: the values of `to_pandas`, read when they are needed."""

import pickle
import sys

import h5py
import numpy as np
import pytest
from store_files import ATTRIBUTES, BLOCK, COLUMNS, N_DESIGNS, fill, values

import explore
from explore.results.store import rows
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.block_bytes import is_sound
from explore.results.store.front_writer import write_front
from explore.results.store.packing import pack


def assert_same(dataset, frame):
    assert list(dataset) == list(frame)
    np.testing.assert_array_equal(dataset["design"], frame.index)
    for name, column in frame.items():
        assert dataset[name].dtype == column.dtype, name
        np.testing.assert_array_equal(dataset[name].to_numpy(), column.to_numpy(), err_msg=name)


@pytest.fixture(params=["complete", "part", "empty", "packed", "front"])
def results(request, tmp_path):
    path = tmp_path / "grid.h5"
    if request.param == "front":
        frame = explore.open_results(fill(path)).to_pandas().reset_index().iloc[[3, 40, 41, 9000]]
        path = tmp_path / "front.h5"
        arrays = {column.name: frame[column.name].to_numpy(column.dtype) for column in COLUMNS}
        front_attributes = {"keep": "front", "studied_designs": N_DESIGNS, "studied_counts": "{}", "tally": "{}"}
        write_front(path, COLUMNS, arrays, 3, {**ATTRIBUTES, **front_attributes})
    elif request.param == "packed":
        pack(fill(path), tmp_path / "packed.h5")
        path = tmp_path / "packed.h5"
    else:
        fill(path, {"complete": range(10), "part": [8, 2, 3, 9], "empty": []}[request.param])
    return explore.open_results(path)


def test_values_are_those_of_pandas(results):
    dataset, frame = explore.xarray(results), results.to_pandas()
    assert_same(dataset, frame)
    assert_same(explore.xarray(str(results.path)), frame)
    assert dataset["crank"][[]].size == 0
    assert dataset["crank"][2:2].size == 0
    if frame.empty:
        return
    for key in (slice(2, None), slice(None, None, 7), slice(None, None, -3), slice(1000, 3100), [0, -1, 1, 1]):
        np.testing.assert_array_equal(dataset["crank"][key].to_numpy(), frame["crank"].to_numpy()[key])
    assert float(dataset["crank"][-1]) == frame["crank"].iloc[-1]
    assert float(dataset["crank"].sel(design=frame.index[2])) == frame["crank"].iloc[2]


def test_attributes_carry_units_and_labels(results):
    dataset = explore.xarray(results)
    assert dataset["crank"].attrs == {"units": "mm", "long_name": COLUMNS[1].long_name}
    status = dataset["status"].attrs
    labels = dict(zip(status["flag_values"].tolist(), status["flag_meanings"].split(), strict=True))
    assert labels == next(column.labels for column in COLUMNS if column.name == "status")
    assert dataset.attrs == dict(results.attributes)
    assert results.to_pandas().attrs["units"]["crank"] == "mm"
    assert results.to_pandas(["crank"]).attrs["units"] == {"crank": "mm"}
    assert results.designs([]).attrs["units"] == results.to_pandas().attrs["units"]


def test_dask_arrays_have_the_same_values_and_can_be_sent_to_workers(finished):
    dataset = explore.xarray(finished)
    chunked = dataset.chunk(design=BLOCK)
    np.testing.assert_array_equal(chunked["crank"].mean(), explore.read_results(finished)["crank"].mean())
    copy = pickle.loads(pickle.dumps(dataset))
    np.testing.assert_array_equal(copy["nodes"][5:9], dataset["nodes"][5:9])


def test_no_column_is_read_before_its_values_are_needed(tmp_path, monkeypatch):
    """A sparse file of 6 million designs, of which little more than the commit words is on the disk."""
    path, count, block = tmp_path / "large.h5", 6_000_000, 65_536
    wanted, arrays = 5_000_000 // block, values(5_000_000 // block, block, count)
    with AllDesignsWriter(path, COLUMNS, count, block, ATTRIBUTES) as writer:
        writer.commit(wanted, arrays)
    with h5py.File(path, "r+") as file:
        words = np.full(len(file["progress/commit"]), 1 << 32, "<u8")
        words[wanted] = file["progress/commit"][wanted, 0]
        file["progress/commit"][:, 0] = words
    checked = []
    monkeypatch.setattr(rows, "is_sound", lambda *block: checked.append(block[2]) or is_sound(*block))
    dataset = explore.xarray(path)
    assert dataset.sizes == {"design": count}
    part = dataset["crank"].isel(design=slice(5_000_000, 5_000_010))
    assert int(part["design"][0]) == 5_000_000
    assert "5000009" in repr(dataset["design"][5_000_009])
    assert checked == []
    assert part.to_numpy().tolist() == arrays["crank"][5_000_000 - wanted * block :][:10].tolist()
    assert dataset["nodes"][5_000_010].item() == 5_000_010 % 97
    assert checked == [wanted], "once for a block"


def test_without_xarray_the_error_names_the_extra(finished, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    monkeypatch.setattr("explore.results.store.results.find_spec", lambda name: None)
    with pytest.raises(explore.RequestError, match=r'pip install "linkage-explore\[xarray\]"'):
        explore.xarray(finished)
