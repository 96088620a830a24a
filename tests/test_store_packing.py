"""Packed copies: the same content in fewer bytes, or no file."""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from command_line import patience
from faults.disks import mounted
from store_files import ATTRIBUTES, BLOCK, COLUMNS, N_BLOCKS, N_DESIGNS, fill, flip, sha256, unseal, values, writer
from waiting import PATIENCE

from explore.base.errors import ResultsError
from explore.base.files import unfinished_name
from explore.results.store import packing
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.results.store.block_bytes import commit_word
from explore.results.store.locking import LockFile
from explore.results.store.open_results import open_results
from explore.results.store.packing import Sink, pack
from explore.results.store.sealing import COMMIT_OFFSET, SEAL


def _attributes(owner: h5py.HLObject) -> dict[str, object]:
    """All attributes but those that depend on where the commit words are."""
    return {name: value for name, value in owner.attrs.items() if name not in (SEAL, COMMIT_OFFSET)}


def assert_same_content(path: Path, original: Path) -> None:
    """Compare groups, attributes, links and values as HDF5 reads them, without explore."""
    with h5py.File(path) as copy, h5py.File(original) as source:
        names: list[str] = []
        source.visit(names.append)
        names_in_copy: list[str] = []
        copy.visit(names_in_copy.append)
        assert names_in_copy == names
        for name in ("/", *names):
            attributes, original_attributes = (_attributes(file[name]) for file in (copy, source))
            assert attributes == original_attributes, name
            if isinstance(source[name], h5py.Dataset):
                assert copy[name].dtype == source[name].dtype
                np.testing.assert_array_equal(copy[name][()], source[name][()], err_msg=name)
        for i, column in enumerate(COLUMNS[1:]):
            assert copy[f"frame/block{i}_values"] == copy["designs"][column.name], "a link, not a copy"


def test_hdf5_finds_the_same_in_both(packed, finished):
    assert_same_content(packed, finished)
    assert packed.stat().st_size < finished.stat().st_size / 2
    assert packed.read_bytes()[8] == 0, "superblock 0, which the oldest readers know"
    with h5py.File(packed) as file:
        for dataset in file["designs"].values():
            assert (dataset.chunks, dataset.compression, dataset.compression_opts) == ((BLOCK,), "gzip", 1)
            assert dataset.shuffle


def test_results_read_both_alike(packed, finished):
    ours, theirs = open_results(packed), open_results(finished)
    assert (ours.is_packed, theirs.is_packed) == (True, False)
    assert ours.columns == theirs.columns
    assert ours.attributes == theirs.attributes
    assert ours.counts == theirs.counts
    assert (ours.is_complete, ours.n_committed, ours.keep) == (True, N_DESIGNS, "all")
    pd.testing.assert_frame_equal(ours.to_pandas(), theirs.to_pandas(), check_exact=True)
    pd.testing.assert_frame_equal(ours.to_pandas(["nodes"]), theirs.to_pandas(["nodes"]), check_exact=True)
    for numbers in ([], [9499], [7, 3, 3, 9000, 4, 2999, 3001], range(N_DESIGNS)[::-1]):
        pd.testing.assert_frame_equal(ours.designs(list(numbers)), theirs.designs(list(numbers)), check_exact=True)
    assert ours.design(8999) == theirs.design(8999)
    for mine, other in zip(ours.blocks(), theirs.blocks(), strict=True):
        for name, expected in other.items():
            assert mine[name].dtype == expected.dtype
            np.testing.assert_array_equal(mine[name], expected)
    assert ours.verify() == []


def test_hdf5_compresses_what_we_decompress(packed, tmp_path):
    """For compressible and incompressible bytes."""
    path = tmp_path / "own.h5"
    noise = np.random.default_rng(1).integers(0, 256, (N_DESIGNS, 8), np.uint8).view("<f8").ravel()
    for numbers in (noise, np.linspace(0.0, 1.0, N_DESIGNS)):
        shutil.copy(packed, path)
        with h5py.File(path, "r+") as file:
            unseal(file)  # the new column has no unit
            del file["designs/crank"]
            file["designs"].create_dataset("crank", data=numbers, chunks=(BLOCK,), compression="gzip", shuffle=True)
            arrays = [file["designs"][column.name][:] for column in COLUMNS]
            slices = [slice(start, start + BLOCK) for start in range(0, N_DESIGNS, BLOCK)]
            file["progress/commit"][:, 0] = [commit_word(a[rows] for a in arrays) for rows in slices]
        np.testing.assert_array_equal(open_results(path).to_pandas(["crank"])["crank"], numbers)


def test_bytes_do_not_depend_on_time(packed, finished, tmp_path):
    time.sleep(1.1)  # HDF5 would keep times in seconds
    pack(finished, tmp_path / "again.h5")
    assert sha256(tmp_path / "again.h5") == sha256(packed)
    assert [p.name for p in tmp_path.iterdir()] == ["again.h5"], "no lock or part file stays"


@pytest.mark.parametrize("n_designs", [1, 2, BLOCK, BLOCK + 1])
def test_small_files(tmp_path, n_designs):
    path, target = tmp_path / "small.h5", tmp_path / "folder" / "packed.h5"
    with AllDesignsWriter(path, COLUMNS, n_designs, BLOCK, ATTRIBUTES) as store:
        for number in store.pending:
            store.commit(number, values(number, BLOCK, n_designs))
        assert store.n_committed == n_designs
    np.testing.assert_array_equal(open_results(path).to_pandas()["crank"], np.arange(n_designs) + 0.25)
    reports: list[tuple[int, int]] = []
    pack(path, target, lambda *state: reports.append(state))
    assert_same_content(target, path)
    n_blocks = -(-n_designs // BLOCK)
    assert reports == [(done, 2 * n_blocks) for done in range(1, 2 * n_blocks + 1)]


# --- refusals --------------------------------------------------------------------------------------------------------


def test_refusals_leave_everything_alone(packed, finished, tmp_path):
    part = fill(tmp_path / "part.h5", [1, 2])
    other = tmp_path / "other.h5"
    other.write_text("my notes")
    alias = tmp_path / "alias.h5"
    alias.symlink_to(finished)
    before = sha256(finished)
    for source, target, text in (
        (part, tmp_path / "new.h5", "part.h5 is not finished; run the sweep or refinement again"),
        (packed, tmp_path / "new.h5", "is packed already"),
        (finished, other, "other.h5 exists already; name another file with `path`"),
        (finished, finished, "is the file to be packed; name another"),
        (finished, alias, "is the file to be packed; name another"),
        (tmp_path / "missing.h5", tmp_path / "new.h5", "does not exist"),
        (other, tmp_path / "new.h5", "not an HDF5 file"),
    ):
        with pytest.raises(ResultsError, match=text):
            pack(source, target)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["alias.h5", "other.h5", "part.h5"]
    assert other.read_text() == "my notes"
    assert sha256(finished) == before


def test_the_unfinished_file_of_a_killed_pack_is_removed(finished, tmp_path):
    left = unfinished_name(tmp_path / "packed.h5")
    left.write_bytes(b"half a copy")
    pack(finished, tmp_path / "packed.h5")
    assert [file.name for file in tmp_path.iterdir()] == ["packed.h5"]


def test_damaged_block_is_not_packed(copy):
    with h5py.File(copy) as file:
        offset = file["designs/nodes"].id.get_offset()
    flip(copy, offset + 4 * (4 * BLOCK + 17))
    with pytest.raises(
        ResultsError, match=r"block 4 \(rows 4000 to 4999\) is damaged; run the sweep or refinement again"
    ):
        pack(copy, copy.with_name("new.h5"))
    assert [p.name for p in copy.parent.iterdir()] == ["copy.h5"]


def test_two_at_once(finished, tmp_path):
    with LockFile(tmp_path / "new.h5"), pytest.raises(ResultsError, match="new.h5 is being written by process"):
        pack(finished, tmp_path / "new.h5")


def test_a_sweep_does_not_go_on_in_a_packed_file(packed_copy):
    before = sha256(packed_copy)
    with pytest.raises(ResultsError, match="packed copy, which cannot be continued; name another"), writer(packed_copy):
        pytest.fail("a packed file was opened for writing")
    assert sha256(packed_copy) == before
    with writer(packed_copy, restart=True) as store:
        assert store.n_pending == N_BLOCKS
    assert sha256(packed_copy.with_name("copy.h5.old")) == before


# --- full disks ------------------------------------------------------------------------------------------------------


LIMITED = """
import resource, sys
from pathlib import Path
sys.path[:0] = {paths!r}
from explore.base.errors import ResultsError
from explore.results.store.packing import pack
for limit in range(1, {size}, {step}):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        pack(Path({source!r}), Path({target!r}))
    except ResultsError as error:
        print(error)
"""


def test_limit_on_the_length_of_a_file(packed, finished, tmp_path):
    """The same call fails as on a full disk, at 60 different lengths: each time with one line, and no crash."""
    size, target = packed.stat().st_size, tmp_path / "new.h5"
    code = LIMITED.format(paths=sys.path, size=size, step=size // 60, source=str(finished), target=str(target))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert len(lines) >= 60
    for line in lines:
        assert re.fullmatch(rf"{target} needs more bytes \([\d,]+ are free\), but .*ulimit -f.*", line), line
    assert list(tmp_path.iterdir()) == []


def test_full_disk(packed, finished, tmp_path):
    """File systems that are too small for the copy, and one that is large enough."""
    size = packed.stat().st_size
    for share in (0.3, 0.6, 0.9, 2.0):
        with mounted(tmp_path, str(int(share * size))):
            if share > 1:
                pack(finished, tmp_path / "new.h5")
                assert sha256(tmp_path / "new.h5") == sha256(packed)
                continue
            with pytest.raises(
                ResultsError, match=r"new\.h5 needs more bytes, but only [\d,]+ are free in .*; free some"
            ):
                pack(finished, tmp_path / "new.h5")
            assert list(tmp_path.iterdir()) == []


def test_sink_stores_the_first_error(tmp_path):
    """`check` and `sync` raise it, and nothing more is written."""
    path = tmp_path / "sink"
    with Sink(path) as sink:
        assert sink.write(b"good") == 4
        os.dup2(broken := os.open(path, os.O_RDONLY), sink._file.fileno())
        os.close(broken)
        assert sink.write(b"lost") == 4
        sink.truncate(100)
        sink.seek(2)
        assert sink.readinto(buffer := bytearray(b"xxxxxx")) == 6
        assert buffer == b"od\0\0\0\0"
        for wrong in (sink.check, sink.sync):
            with pytest.raises(OSError, match="Bad file descriptor"):
                wrong()
    assert path.read_bytes() == b"good"


def test_interrupt_leaves_nothing_behind(finished, tmp_path):
    def stop(done: int, total: int) -> None:
        if done == 15:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pack(finished, tmp_path / "new.h5", stop)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_the_thread_starts_packs_nothing(finished, tmp_path, monkeypatch):
    """Python's pools do not wait for a thread whose start was interrupted, which would write on."""
    packed, before, start = [], set(threading.enumerate()), threading.Thread.start

    def interrupted(thread):
        start(thread)
        raise KeyboardInterrupt

    monkeypatch.setattr(packing, "_pack", lambda *_: packed.append(True))
    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        pack(finished, tmp_path / "new.h5")
    for thread in set(threading.enumerate()) - before:
        thread.join()
    assert packed == []


ENDLESS = """
import signal
from pathlib import Path
from explore.results.store.packing import pack
signal.signal(signal.SIGINT, signal.default_int_handler)
while True:
    try:
        print("ready", flush=True)
        while True:
            pack(Path({source!r}), Path({target!r}))
            Path({target!r}).unlink()
    except KeyboardInterrupt:
        print("stopped", flush=True)
        input()
"""


def test_ctrl_c_at_any_time_leaves_nothing_behind(finished, tmp_path):
    """A real signal, which must not be lost in a callback of HDF5 nor crash it."""
    chance, target = random.Random(3), tmp_path / "new.h5"
    code = ENDLESS.format(source=str(finished), target=str(target))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with patience(PATIENCE), subprocess.Popen([sys.executable, "-c", code], env=environment, **pipes) as process:
        try:
            for _ in range(20):
                assert process.stdout.readline() == "ready\n"
                time.sleep(0.02 + chance.random() * 0.2)
                process.send_signal(signal.SIGINT)
                assert process.stdout.readline() == "stopped\n"
                target.unlink(missing_ok=True)
                assert list(tmp_path.iterdir()) == []
                process.stdin.write("\n")
                process.stdin.flush()
        finally:
            process.kill()


def test_an_attribute_that_is_no_signed_integer_of_64_bits_is_left_out(copy):
    """Other programs may write unsigned ones."""
    with h5py.File(copy, "r+") as file:
        file.attrs["foreign"] = np.uint64(2**64 - 1)
    pack(copy, copy.with_name("packed.h5"))
    assert "foreign" not in open_results(copy.with_name("packed.h5")).attributes
    assert open_results(copy.with_name("packed.h5")).verify() == []


def test_the_copy_is_durable_before_it_has_its_name(finished, tmp_path, monkeypatch):
    """At its full length, including the bytes that HDF5 writes when it closes the file."""
    target, synchronised = tmp_path / "new.h5", []

    def sync(descriptor: int, real=os.fsync) -> None:
        status = os.fstat(descriptor)
        synchronised.append((status.st_ino, status.st_size, target.exists()))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", sync)
    pack(finished, target)

    assert (target.stat().st_ino, target.stat().st_size, False) in synchronised


def test_a_copy_that_does_not_read_back_is_not_kept(finished, tmp_path, monkeypatch):
    """A missing block is noticed although it does not count as damaged."""
    write = packing._write

    def forgetful(file, layout, words, path, report):
        write(file, layout, words, path, report)
        with h5py.File(path, "r+") as copy:
            copy["progress/commit"][3, 0] = 0

    monkeypatch.setattr(packing, "_write", forgetful)
    with pytest.raises(ResultsError, match="does not read back as written"):
        pack(finished, tmp_path / "new.h5")
    assert list(tmp_path.iterdir()) == []
