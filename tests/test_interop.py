"""Other programs read the values, types and units of a results file as explore does."""

import re
import shutil
import subprocess
import warnings

import h5py
import numpy as np
import pandas as pd
import pytest
from studies import crank_rockers, sweep_text

import explore

#: Has designs of several statuses, so that there are NaN, and columns of every type: f8, i8, i4 and i1, with labels.
STUDY = (
    crank_rockers((60, 220, 23), rocker=[541.7118, 500], speed='[0.3333333333333333, "60 rpm"]')
    + """\
[evaluate]
metrics = ["linkage_class", "swing_angle", "transmission_angle_min", "cv", "rocker_acceleration_max"]
[constraints]
transmission_angle_min = { min = 15 }
"""
)


@pytest.fixture(scope="module")
def results_and_table(tmp_path_factory):
    """A results file, and the table that `explore` reads from it, with `feasible` as stored."""
    folder = tmp_path_factory.mktemp("results")
    path = sweep_text(folder, STUDY, "results").path
    frame = explore.read_results(path)
    assert frame["feasible"].dtype == bool
    frame = frame.astype({"feasible": "i1"})
    assert {dtype.str for dtype in frame.dtypes} == {"<f8", "<i4", "|i1"}
    assert frame.index.dtype == np.int64
    assert frame["cv"].isna().any()
    assert frame["cv"].notna().any()
    assert frame["status"].nunique() >= 3
    assert frame["feasible"].nunique() == 2
    return path, frame


def columns(frame):
    """All columns by name, the index as one of them."""
    return {name: values.to_numpy() for name, values in frame.reset_index().items()}


def assert_equal_bits(expected, actual):
    """The same names, types and bits of the values, so also of NaN and of the sign of zero."""
    assert set(actual) == set(expected)
    for name, values in expected.items():
        assert actual[name].dtype == values.dtype, name
        assert actual[name].tobytes() == values.tobytes(), name


def test_pandas(results_and_table):
    pytest.importorskip("tables")
    path, frame = results_and_table
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pd.testing.assert_frame_equal(pd.read_hdf(path), frame, check_exact=True)


def test_h5py(results_and_table):
    path, frame = results_and_table
    with h5py.File(path) as file:
        assert_equal_bits(columns(frame), {name: dataset[:] for name, dataset in file["designs"].items()})
        assert file["designs/crank"].attrs["units"] == b"mm"


def test_xarray(results_and_table):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    path, frame = results_and_table
    with xarray.open_dataset(path, group="designs", engine="h5netcdf", phony_dims="sort") as data:
        assert_equal_bits(columns(frame), {name: values.to_numpy() for name, values in data.items()})
        assert data["rocker_acceleration_max"].attrs["units"] == "rad/s^2"


def find_program(name):
    """Path of another program; without it the test is skipped."""
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not installed")
    return path


def run(*command, cwd=None):
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


H5_TYPES = {"f8": "H5T_IEEE_F64LE", "i8": "H5T_STD_I64LE", "i4": "H5T_STD_I32LE", "i1": "H5T_STD_I8LE"}


def test_h5dump(results_and_table, tmp_path):
    """HDF5 1.10.8 on Debian 12: an old library reads every byte, every type and the units."""
    h5dump = find_program("h5dump")
    path, frame = results_and_table
    dumped = {}
    for name, values in columns(frame).items():
        binary = tmp_path / f"{name}.bin"
        output = run(h5dump, "-d", f"/designs/{name}", "-b", "LE", "-o", str(binary), str(path))
        assert H5_TYPES[values.dtype.str[1:]] in output, name
        dumped[name] = np.fromfile(binary, values.dtype)
    assert_equal_bits(columns(frame), dumped)
    header = run(h5dump, "-A", "-d", "/designs/crank", str(path))
    assert re.search(r'ATTRIBUTE "units".*?\(0\): "mm"', header, re.DOTALL)


def test_h5dump_as_text(results_and_table):
    """With 17 digits, which determine a double."""
    h5dump = find_program("h5dump")
    path, frame = results_and_table
    output = run(h5dump, "-d", "/designs/cv", "-y", "-w", "0", "-m", "%.17g", str(path))
    numbers = re.search(r"DATA \{(.*?)\}", output, re.DOTALL)[1].replace(",", " ").split()
    np.testing.assert_array_equal(np.array(numbers, float), frame["cv"].to_numpy())


OCTAVE = """
results = load ("{path}");
designs = results.designs;
names = fieldnames (designs);
for k = 1:numel (names)
  column = designs.(names{{k}});
  printf ("%s %s %d %d\\n", names{{k}}, class (column), rows (column), columns (column));
  printf (" %.17g", column);
  printf ("\\n");
end
"""
OCTAVE_TYPES = {"f8": "double", "i8": "int64", "i4": "int32", "i1": "int8"}


def test_octave(results_and_table):
    octave = find_program("octave-cli")
    path, frame = results_and_table
    lines = run(octave, "--norc", "--eval", OCTAVE.format(path=path)).splitlines()
    expected = columns(frame)
    names = [line.split()[0] for line in lines[::2]]
    assert sorted(names) == sorted(expected)
    for header, text in zip(lines[::2], lines[1::2], strict=True):
        name, kind, *shape = header.split()
        assert kind == OCTAVE_TYPES[expected[name].dtype.str[1:]], name
        assert shape == ["1", str(len(frame))]
        np.testing.assert_array_equal(
            np.array(text.split(), float).astype(expected[name].dtype), expected[name], err_msg=name
        )
