"""The results file: its layout, its readers, and what kills, damage and other programs do to it."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import io
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from explore.errors import ResultsError
from explore.store import platform
from explore.store.creation import create
from explore.store.image import Image
from explore.store.locking import LockFile
from explore.store.results import open_results
from explore.store.writer import Writer
from explore.vocabulary import Column, Status

LABELS = {int(status): status.label for status in Status}
COLUMNS = (
    Column("design", "", "design number", "index", "<i8"),
    Column("crank", "mm", "crank length", "parameter"),
    Column("rocker_velocity_max", "rad/s", "greatest velocity ω", "metric"),
    Column("nodes", "", "signal evaluations", "bookkeeping", "<i4"),
    Column("status", "", "what became of the design", "bookkeeping", "|i1", LABELS),
    Column("feasible", "", "meets every constraint", "bookkeeping", "|i1"),
)
ATTRIBUTES = {
    "config": 'mechanism = "crank-rocker"  # ω\n',
    "request_sha256": "ab" * 32,
    "determines": json.dumps({"mechanism": "crank-rocker", "parameters": {"crank": [1, 2], "ground": 3}}),
    "kernel": "four-bar 1",
    "versions": json.dumps({"numpy": "2"}),
    "seed": 1,
    "sampler": "grid",
}
#: 1000 rows a block make columns of several pages; the last block is shorter, as in most studies.
BLOCK, N_DESIGNS = 1000, 9500
N_BLOCKS = 10
#: Kills of a real writer; each costs about half a second, mostly the child's imports.
KILLS = 12


def values(number: int, block: int = BLOCK, n_designs: int = N_DESIGNS) -> dict[str, np.ndarray]:
    """Columns of a block that differ in every row, with NaN where a design failed."""
    design = np.arange(number * block, min((number + 1) * block, n_designs))
    status = np.where(design % 7 == 3, Status.CRANK_BLOCKED, Status.OK).astype("|i1")
    return {
        "crank": design + 0.25,
        "rocker_velocity_max": np.where(status == Status.OK, np.sqrt(design), np.nan),
        "nodes": (design % 97).astype("<i4"),
        "status": status,
        "feasible": (design % 2).astype("|i1"),
    }


def writer(path: Path, **changes) -> Writer:
    attributes = ATTRIBUTES | changes.pop("attributes", {})
    return Writer(path, COLUMNS, N_DESIGNS, BLOCK, attributes, **changes)


def fill(path: Path, numbers=range(N_BLOCKS)) -> Path:
    with writer(path) as store:
        for number in numbers:
            store.commit(number, values(number))
    return path


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def assert_block_is_right(path: Path, number: int) -> None:
    frame = open_results(path).to_pandas()
    start = number * BLOCK
    for name, expected in values(number).items():
        np.testing.assert_array_equal(frame.loc[start : start + BLOCK - 1, name], expected, err_msg=name)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    return fill(tmp_path_factory.mktemp("finished") / "grid.h5")


@pytest.fixture
def copy(finished, tmp_path) -> Path:
    path = tmp_path / "copy.h5"
    path.write_bytes(finished.read_bytes())
    return path


# --- the writer as a process of its own ------------------------------------------------------------------------------


def child(path: Path, blocks: str) -> subprocess.Popen:
    """A real process that writes; it says 'ready' before it opens the file and each number once it is durable."""
    command = [sys.executable, __file__, str(path), blocks]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)


def kill(process: subprocess.Popen) -> list[str]:
    """Kill -9; returns what the process had said."""
    process.send_signal(signal.SIGKILL)
    said = process.stdout.read().split()
    process.stdout.close()
    process.wait()
    return said


def say(word: str) -> None:
    sys.stdout.write(word + "\n")
    sys.stdout.flush()


def write_as_child(path: Path, blocks: str) -> None:
    say("ready")
    with writer(path) as store:
        if blocks == "none":
            say("holding")
            time.sleep(600)
        for number in store.pending:
            store.commit(number, values(number))
            say(str(number))


# --- layout and readers ----------------------------------------------------------------------------------------------


def test_layout_is_what_other_programs_need(finished):
    with h5py.File(finished) as file:
        assert dict(file.attrs) == {
            **{name: v.encode() if isinstance(v, str) else v for name, v in ATTRIBUTES.items()},
            "format": b"explore-results",
            "format_version": 1,
            "n_designs": N_DESIGNS,
            "block_size": BLOCK,
        }
        assert set(file) == {"designs", "frame", "progress"}
        assert file["progress/commit"].shape == (N_BLOCKS,)
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
        assert len(labels) == len(Status)
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
    assert results.complete
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
    assert results.verify() == []


def test_part_of_the_columns_and_blocks_in_order(finished):
    results = open_results(finished)
    assert list(results.to_pandas(["nodes", "design", "crank"])) == ["nodes", "crank"]
    blocks = list(results.blocks(["design", "feasible"]))
    assert [len(block["design"]) for block in blocks] == [BLOCK] * 9 + [500]
    np.testing.assert_array_equal(np.concatenate([b["design"] for b in blocks]), np.arange(N_DESIGNS))
    assert blocks[0]["feasible"].dtype == bool
    assert set(next(results.blocks())) == {column.name for column in COLUMNS}


@pytest.mark.parametrize("numbers", [[], [9499], [7, 3, 3, 9000, 4, 2999, 3001], range(N_DESIGNS)[::-1]])
def test_single_rows_in_the_order_asked_for(finished, numbers):
    results = open_results(finished)
    expected = results.to_pandas().loc[list(numbers)]
    pd.testing.assert_frame_equal(results.rows(list(numbers)), expected, check_exact=True)


def test_only_committed_rows_are_given(tmp_path):
    path = fill(tmp_path / "part.h5", [8, 2, 3, 9])
    results = open_results(path)
    rows = np.r_[2000:4000, 8000:9500]
    assert not results.complete
    assert results.n_committed == 3500
    np.testing.assert_array_equal(results.to_pandas().index, rows)
    np.testing.assert_array_equal(results.to_pandas(["crank"])["crank"], rows + 0.25)
    assert sum(results.counts.values()) == 3500
    with pytest.raises(ResultsError, match="design 1999 is not computed yet"):
        results.design(1999)
    with pytest.raises(ResultsError, match="design 7000 is not computed yet"):
        results.rows([2000, 7000])


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
        with pytest.raises(ResultsError, match=f"no design {number}: they are numbered 0 to 9499"):
            results.design(number)
        with pytest.raises(ResultsError, match=f"no design {number}: they are numbered 0 to 9499"):
            results.rows([3, number, 5])


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
    create(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES | {"config": text})
    assert open_results(path).config == text
    with h5py.File(path) as file:
        assert ("study" in file) == (length > 60_000)


@pytest.mark.parametrize("n_designs", [1, 2, BLOCK, BLOCK + 1])
def test_small_files(tmp_path, n_designs):
    path = tmp_path / "small.h5"
    with Writer(path, COLUMNS, n_designs, BLOCK, ATTRIBUTES) as store:
        for number in store.pending:
            store.commit(number, values(number, BLOCK, n_designs))
        assert store.committed_designs == n_designs
    np.testing.assert_array_equal(open_results(path).to_pandas()["crank"], np.arange(n_designs) + 0.25)


def test_image_behaves_like_a_file():
    """Random writes and reads against an ordinary file in memory, which keeps every byte."""
    chance = random.Random(3)
    image, plain = Image(), io.BytesIO()
    for _ in range(200):
        place, length = chance.randrange(500), chance.randrange(1, 60)
        for file in (image, plain):
            file.seek(place)
        if chance.random() < 0.5:
            data = chance.randbytes(length)
            assert image.write(data) == plain.write(data)
        else:
            ours, theirs = bytearray(length), bytearray(length)
            image.readinto(ours)
            plain.readinto(theirs)  # leaves zeros beyond the end, as the image gives them
            assert ours == theirs
    assert image.seek(0, io.SEEK_END) == plain.seek(0, io.SEEK_END) == image.tell()


def test_create_refuses_nonsense(tmp_path):
    for columns, n_designs in (
        (COLUMNS[1:], 5), (COLUMNS[:1], 5), (COLUMNS + COLUMNS[1:2], 5), (COLUMNS, 0),
        ((*COLUMNS, Column("a/b", "", "", "metric")), 5),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"column|design"):
            create(tmp_path / "x.h5", columns, n_designs, BLOCK, ATTRIBUTES)
    assert list(tmp_path.iterdir()) == []


# --- the same bytes, whatever happens --------------------------------------------------------------------------------


def test_bytes_do_not_depend_on_order_or_time(finished, tmp_path):
    time.sleep(1.1)  # HDF5 would keep times in seconds
    for name, order in (("back.h5", range(N_BLOCKS)[::-1]), ("mixed.h5", random.Random(2).sample(range(10), 10))):
        assert sha256(fill(tmp_path / name, order)) == sha256(finished)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["back.h5", "mixed.h5"], "no lock or part file stays"


def test_hdf5_metadata_never_changes(tmp_path):
    """Outside the columns and the commit words every byte is as it was at the start."""
    path = tmp_path / "grid.h5"
    create(path, COLUMNS, N_DESIGNS, BLOCK, ATTRIBUTES)
    before = np.frombuffer(path.read_bytes(), np.uint8)
    fill(path)
    after = np.frombuffer(path.read_bytes(), np.uint8)
    free = np.zeros(len(before), bool)
    with h5py.File(path) as file:
        for dataset in (*file["designs"].values(), file["progress/commit"]):
            start = dataset.id.get_offset()
            free[start : start + dataset.nbytes] = True
    assert np.any(before != after)
    assert not np.any((before != after) & ~free)


def test_resume_after_kill_loses_nothing(finished, tmp_path):
    chance = random.Random(20_240_601)
    path = tmp_path / "grid.h5"
    for trial in range(KILLS):
        process = child(path, "all")
        assert process.stdout.readline() == "ready\n"
        acknowledged = []
        for _ in range(chance.randrange(N_BLOCKS)):
            line = process.stdout.readline()
            acknowledged += [int(line)] if line else []
        time.sleep(chance.random() * 0.02)  # creating takes about 10 ms, a block about 1 ms
        acknowledged += map(int, kill(process))
        if path.exists():
            results = open_results(path)
            committed = set(range(N_BLOCKS)) - set(still_pending(path))
            assert set(acknowledged) <= committed, f"trial {trial}"
            assert results.verify() == []
            for number in committed:
                assert_block_is_right(path, number)
        else:
            assert not acknowledged
        if path.exists() and not still_pending(path):
            assert sha256(path) == sha256(finished)
            path.unlink()
    fill(path, still_pending(path) if path.exists() else range(N_BLOCKS))
    assert sha256(path) == sha256(finished)
    assert [p.name for p in tmp_path.iterdir()] == ["grid.h5"], "what killed writers left behind is cleaned up"


def still_pending(path: Path) -> list[int]:
    with writer(path) as store:
        return list(store.pending)


def test_damaged_block_is_pending_again(copy):
    with h5py.File(copy) as file:
        offsets = [file["designs"][name].id.get_offset() for name in ("design", "nodes", "feasible")]
        commit = file["progress/commit"].id.get_offset()
    original = sha256(copy)
    for number, (offset, size) in zip((1, 4, 9), zip(offsets, (8, 4, 1), strict=True), strict=True):
        flip(copy, offset + (number * BLOCK + 17) * size)
    flip(copy, commit + 8 * 6)
    assert open_results(copy).verify() == [1, 4, 6, 9]
    with writer(copy) as store:
        assert list(store.pending) == [1, 4, 6, 9]
        assert open_results(copy).n_committed == N_DESIGNS - 3500, "readers no longer see them either"
        for number in store.pending:
            store.commit(number, values(number))
    assert sha256(copy) == original


def flip(path: Path, offset: int) -> None:
    with path.open("r+b") as file:
        file.seek(offset)
        byte = file.read(1)[0]
        file.seek(offset)
        file.write(bytes([byte ^ 0x10]))


def test_reading_while_writing(tmp_path):
    pytest.importorskip("tables")
    path = tmp_path / "grid.h5"
    with writer(path) as store:
        held = open_results(path)
        for done, number in enumerate([3, 0, 7], 1):
            store.commit(number, values(number))
            assert open_results(path).n_committed == done * BLOCK == store.committed_designs
            assert_block_is_right(path, number)
            frame = pd.read_hdf(path)
            assert int((frame["status"] != Status.PENDING).sum()) == done * BLOCK
        assert held.n_committed == 0, "results are what was there when they were opened"
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
        }
        for text, (number, columns) in wrong.items():
            with pytest.raises(ValueError, match=text.strip()):
                store.commit(number, columns)
        assert sha256(path) == before
        store.commit(1, good | {"crank": np.repeat(good["crank"], 2)[::2], "design": np.arange(1000, 2000)})
    assert_block_is_right(path, 1)


# --- one writer ------------------------------------------------------------------------------------------------------


def test_second_writer_is_refused_until_the_first_is_gone(tmp_path):
    path = tmp_path / "grid.h5"
    process = child(path, "none")
    try:
        assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "holding\n"]
        with pytest.raises(ResultsError, match=rf"grid.h5 is being written by process {process.pid} on host \S+; wait"):
            fill(path)
        with pytest.raises(BlockingIOError):
            h5py.File(path, "r+")
        assert open_results(path).n_committed == 0, "readers are welcome"
    finally:
        kill(process)
    fill(path)  # free at once, no waiting and nothing to clean up by hand
    assert open_results(path).complete


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_files_of_the_writer_are_not_inherited(tmp_path):
    path = tmp_path / "grid.h5"
    with writer(path):
        held = [fd for fd in open_files() if open_files()[fd].startswith(str(path))]
        assert {open_files()[fd] for fd in held} == {str(path), f"{path}.lock"}
        assert not any(os.get_inheritable(fd) for fd in held)
    assert not any(name.startswith(str(path)) for name in open_files().values())


def open_files() -> dict[int, str]:
    """Names of this process's open files by descriptor, as Linux tells them."""
    names = {}
    for link in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # the one that lists the folder
            names[int(link.name)] = str(link.readlink())
    return names


def test_four_writers_at_once_write_each_block_once(finished, tmp_path):
    path = tmp_path / "grid.h5"
    processes = [child(path, "all") for _ in range(4)]
    said = []
    for process in processes:
        said += process.communicate(timeout=60)[0].split()
    assert sorted(int(word) for word in said if word != "ready") == list(range(N_BLOCKS))
    assert sha256(path) == sha256(finished)


def test_lock_file_removed_by_its_last_holder_is_no_lock(tmp_path, monkeypatch):
    """The last holder may remove the file between our opening and locking it: another one would then hold the name."""
    path, lock = tmp_path / "grid.h5", platform.lock
    removals = iter([True])

    def late(descriptor: int) -> bool:
        if next(removals, False):
            path.with_name("grid.h5.lock").unlink()
        return lock(descriptor)

    monkeypatch.setattr(platform, "lock", late)
    with LockFile(path), pytest.raises(ResultsError, match="is being written by process"), LockFile(path):
        pytest.fail("two writers hold the lock")


def test_other_program_that_writes_is_noticed(copy):
    with h5py.File(copy, "r+"):
        # HDF5 in this process would share the file: look from another one
        process = child(copy, "all")
        out, _ = process.communicate(timeout=60)
        assert (process.returncode, out) == (1, "ready\ncopy.h5 is open for writing in another program\n")


# --- another study ---------------------------------------------------------------------------------------------------


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
    assert text[-1] == "use --restart to start over"
    assert sha256(copy) == before
    fill(copy, [])  # the refusal let go of the lock


def test_changed_size_is_refused(copy):
    with pytest.raises(ResultsError, match="designs: 9500 -> 9501"), Writer(copy, COLUMNS, 9501, BLOCK, ATTRIBUTES):
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


# --- files that are not sound ----------------------------------------------------------------------------------------


def test_missing_file(tmp_path):
    with pytest.raises(ResultsError, match=r"missing.h5 does not exist; run `explore sweep`"):
        open_results(tmp_path / "missing.h5")


@pytest.mark.parametrize("content", [b"", b"a,b\n1,2\n", b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" + bytes(500)])
def test_files_that_are_not_hdf5(tmp_path, content):
    path = tmp_path / "text.h5"
    path.write_bytes(content)
    with pytest.raises(ResultsError, match=r"text\.h5 is (not an HDF5 file|damaged|cut short)"):
        open_results(path)


def test_folder_in_place_of_a_file(tmp_path):
    with pytest.raises(ResultsError):
        open_results(tmp_path)


def test_file_cut_anywhere(copy):
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
        file.attrs["format_version"] = 2
    with pytest.raises(ResultsError, match=r"format version 2.*newer explore; update"):
        open_results(copy)


def external_column(file: h5py.File) -> None:
    del file["designs/crank"]
    file["designs/crank"] = h5py.ExternalLink("other.h5", "/designs/crank")


def chunked_column(file: h5py.File) -> None:
    del file["designs/crank"]
    file["designs"].create_dataset("crank", (N_DESIGNS,), "<f8", chunks=(BLOCK,))


def vast_column(file: h5py.File) -> None:
    """Claims 8 PB, none of it in the file."""
    for name in COLUMNS:
        del file["designs"][name.name]
        file["designs"].create_dataset(name.name, (10**15,), name.dtype, fill_time="never")
    file.attrs["n_designs"] = 10**15


def text_column(file: h5py.File) -> None:
    del file["designs/crank"]
    file["designs/crank"] = np.full(N_DESIGNS, b"abc")


HOSTILE = {
    "n_designs larger than the columns": lambda file: file.attrs.modify("n_designs", 10**15),
    "n_designs smaller": lambda file: file.attrs.modify("n_designs", 10),
    "n_designs negative": lambda file: file.attrs.modify("n_designs", -1),
    "n_designs is a text": lambda file: file.attrs.create("n_designs", "many"),
    "block_size zero": lambda file: file.attrs.modify("block_size", 0),
    "block_size smaller": lambda file: file.attrs.modify("block_size", 1),
    "no columns": lambda file: file.__delitem__("designs"),
    "no index": lambda file: file["designs"].__delitem__("design"),
    "no commit words": lambda file: file.__delitem__("progress/commit"),
    "no names": lambda file: file.__delitem__("frame/axis0"),
    "one column more": lambda file: file["designs"].create_dataset("more", data=np.zeros(3)),
    "labels are no JSON": lambda file: file["designs/status"].attrs.create("labels", "{"),
    "labels are a list": lambda file: file["designs/status"].attrs.create("labels", "[1]"),
    "a column in another file": external_column,
    "a chunked column": chunked_column,
    "columns of 8 PB": vast_column,
    "a column of texts": text_column,
}


@pytest.mark.parametrize("change", HOSTILE.values(), ids=HOSTILE)
def test_hostile_headers_are_refused(copy, change):
    with h5py.File(copy, "r+") as file:
        change(file)
    with pytest.raises(ResultsError, match=r"copy\.h5 is damaged"):
        open_results(copy)


def test_random_damage_never_gives_another_error(copy):
    """300 files with 1 to 20 wrong bytes among HDF5's own: each opens or is refused in words."""
    whole = bytearray(copy.read_bytes())
    chance = random.Random(7)
    refused = 0
    for _ in range(300):
        damaged = bytearray(whole)
        for _ in range(chance.randrange(1, 20)):
            damaged[chance.randrange(4096)] = chance.randrange(256)  # the columns start at byte 4096
        copy.write_bytes(damaged)
        try:
            open_results(copy).counts  # noqa: B018
        except ResultsError:
            refused += 1
    assert refused > 0


# --- disks and platforms ---------------------------------------------------------------------------------------------

LIMITED = """
import resource, sys
from pathlib import Path
sys.path[:0] = {paths!r}
import test_store
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    test_store.fill(Path({path!r}))
except test_store.ResultsError as error:
    print(error)
"""


def test_full_disk_leaves_nothing_behind(tmp_path):
    """A limit on the file's length stands for the full disk: the same call fails, at the same place."""
    path = tmp_path / "grid.h5"
    code = LIMITED.format(paths=[str(Path(__file__).parent), *sys.path], path=str(path))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{path} needs " in done.stdout
    assert "ulimit" in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_disk_too_small_says_how_much_is_missing(tmp_path):
    # 1 PB: more than any disk of this machine, less than a file system's own limit on most; either is said clearly
    with pytest.raises(ResultsError, match=r"needs [\d,]{15,} bytes.*free"):
        create(tmp_path / "grid.h5", COLUMNS, 10**15 // 30, 65_536, ATTRIBUTES)
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_written():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o555)
        user = os.geteuid()
        try:
            if user == 0:
                os.seteuid(65_534)  # nobody: the superuser may write anywhere
            with pytest.raises(ResultsError, match=r"cannot be written: Permission denied; choose another with -o"):
                fill(folder / "grid.h5")
        finally:
            os.seteuid(user)
            folder.chmod(0o755)
        assert list(folder.iterdir()) == []


def test_missing_folders_are_made(tmp_path):
    assert fill(tmp_path / "a" / "b" / "grid.h5", [0]).exists()


def test_disk_error_on_commit_is_reported_and_leaves_the_block_pending(tmp_path):
    """A read-only descriptor in place of the disk error: the system refuses the write."""
    path = tmp_path / "grid.h5"
    with writer(path) as store:
        store.commit(0, values(0))
        broken = os.open(path, os.O_RDONLY)
        os.dup2(broken, store._descriptor)
        os.close(broken)
        with pytest.raises(ResultsError, match=r"grid\.h5: block 1 cannot be written: .*run the sweep again"):
            store.commit(1, values(1))
        assert list(store.pending) == list(range(1, N_BLOCKS))
    assert open_results(path).n_committed == BLOCK


def test_file_system_that_cannot_reserve(finished, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    assert sha256(fill(tmp_path / "grid.h5")) == sha256(finished)


def test_without_posix_the_bytes_are_the_same(finished, tmp_path, monkeypatch):
    for name in ("posix_fallocate", "fdatasync", "pwrite"):
        monkeypatch.delattr(os, name)
    path = fill(tmp_path / "grid.h5")
    assert sha256(path) == sha256(finished)
    assert path.stat().st_blocks * 512 >= path.stat().st_size, "the space is reserved all the same"


class FakeMsvcrt:
    """Windows' byte lock, made of flock: the real one cannot be had here."""

    LK_NBLCK = 2

    @staticmethod
    def locking(descriptor: int, mode: int, count: int) -> None:
        assert (mode, count) == (2, 1)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(errno.EACCES, "Permission denied") from None  # what msvcrt raises


def test_lock_without_posix(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", FakeMsvcrt)
    path = tmp_path / "grid.h5"
    with writer(path), pytest.raises(ResultsError, match="is being written by process"):
        fill(path)
    fill(path)
    monkeypatch.setitem(sys.modules, "msvcrt", None)
    with path.open("rb") as file, pytest.raises(OSError, match="no file locks"):
        platform.lock(file.fileno())


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        write_as_child(Path(sys.argv[1]), sys.argv[2])
    except ResultsError as error:
        if "being written" not in str(error):
            say(Path(sys.argv[1]).name + str(error).removeprefix(sys.argv[1]).partition(";")[0])
            sys.exit(1)
