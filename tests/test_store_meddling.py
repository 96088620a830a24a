"""Other programs move, remove or replace the files of a sweep while it runs, or have files of the same names."""

import errno
import os
import shutil
import stat
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_refused, call
from store_files import fill, sha256, values, writer
from studies import grid, swept

import explore
from explore.base import files
from explore.base.errors import ResultsError
from explore.base.files import new_file, unfinished_name
from explore.results.store.journal import Journal
from explore.results.store.locking import LockFile
from explore.results.store.open_results import open_results
from explore.results.store.sidecar_files import journal_name, remove_leftovers
from explore.running.log import Log, log_path

#: 151,200 designs in three blocks; few of them are Pareto-optimal.
STUDY = grid("""\
[evaluate]
metrics = ["swing_angle", "transmission_angle_min"]
[rank]
metrics = ["swing_angle:max", "transmission_angle_min:max"]
""")


@pytest.fixture
def study(tmp_path):
    (tmp_path / "grid.toml").write_text(STUDY)
    return explore.load_study(tmp_path / "grid.toml")


def sweep_and_meddle(study, path, meddle, after=1, **options):
    """Sweep a study, and call `meddle` once after this number of blocks."""
    n_done = 0

    def count_blocks(*_):
        nonlocal n_done
        n_done += 1
        if n_done == after:
            meddle(path)

    return explore.sweep(study, path, report_progress=count_blocks, **options)


# --- the results file is moved, removed or replaced ------------------------------------------------------------------


def replace(path: Path) -> None:
    """Replace the file by a copy of itself."""
    shutil.copy(path, path.with_name("copy"))
    path.with_name("copy").replace(path)


def swap(path: Path) -> None:
    path.rename(path.with_name("moved.h5"))
    path.write_text("my thesis")


def move(path: Path) -> None:
    path.rename(path.with_name("moved.h5"))


DISPLACEMENTS = {
    "replaced": (replace, r"grid\.h5 was replaced by another file during the sweep; .* are lost with it: .* is a copy"),
    "swapped": (swap, r"was moved to .*moved\.h5 and replaced by another file during.*65,536 designs are safe there"),
    "moved": (move, r"was moved to .*moved\.h5 during the sweep; its 65,536 designs are safe there: move it back"),
    "removed": (
        Path.unlink,
        r"grid\.h5 was removed during the sweep; .* are lost with it: run the sweep or refinement again to start",
    ),
}


@pytest.mark.parametrize("after", [1, 3], ids=["first block", "last block"])
@pytest.mark.parametrize("kind", DISPLACEMENTS)
def test_sweep_stops_when_its_file_was_moved_removed_or_replaced(study, tmp_path, kind, after):
    meddle, message = DISPLACEMENTS[kind]
    message = message.replace("65,536", "65,536" if after == 1 else "151,200")
    with pytest.raises(ResultsError, match=message) as caught:
        sweep_and_meddle(study, tmp_path / "grid.h5", meddle, after)
    assert "\n" not in str(caught.value)
    if "safe there" in message:
        assert open_results(tmp_path / "moved.h5").n_committed == (65_536 if after == 1 else 151_200)


def test_a_copy_that_replaced_the_file_is_checked_and_continued(study, tmp_path):
    path = tmp_path / "grid.h5"
    with pytest.raises(ResultsError, match="replaced"):
        sweep_and_meddle(study, path, replace, after=2)
    results = explore.sweep(study, path)
    assert results.is_complete
    assert results.verify() == []
    explore.sweep(study, tmp_path / "undisturbed.h5")
    assert sha256(path) == sha256(tmp_path / "undisturbed.h5")


# --- the journal of a sweep that keeps the front ---------------------------------------------------------------------


def test_file_that_appears_during_the_sweep_is_not_overwritten(study, tmp_path):
    path = tmp_path / "grid.h5"
    with pytest.raises(
        ResultsError, match=r"grid\.h5 was made by another program meanwhile, so it is left alone; move"
    ):
        sweep_and_meddle(study, path, lambda path: path.write_text("my thesis"), keep="front")
    assert path.read_text() == "my thesis"
    with pytest.raises(ResultsError, match=r"grid\.h5 is not a results file.*; move it away to go on with the sweep"):
        explore.sweep(study, path, keep="front")
    path.unlink()
    reports = []
    explore.sweep(study, path, keep="front", report_progress=lambda *counts: reports.append(counts))
    assert reports == [], "nothing was lost"


@pytest.mark.parametrize("after", [1, 3], ids=["first block", "last block"])
def test_removed_journal_is_written_anew(study, tmp_path, after):
    path = tmp_path / "grid.h5"
    sweep_and_meddle(study, path, lambda path: journal_name(path).unlink(), after, keep="front")
    explore.sweep(study, tmp_path / "undisturbed.h5", keep="front")
    assert sha256(path) == sha256(tmp_path / "undisturbed.h5")
    assert not journal_name(path).exists()


def test_a_journal_written_anew_holds_all_records(tmp_path):
    path = tmp_path / "a.journal"
    with Journal(path, {"determines": "{}"}) as journal:
        for number in range(5):
            if number == 3:
                path.unlink()
            journal.append({"block": number}, {"design": np.arange(number * 100_000)})
        assert [meta["block"] for meta, _ in journal.records()] == list(range(5))
        before = path.read_bytes()
    with Journal(path, {"determines": "{}"}) as journal:
        assert [len(arrays["design"]) for _, arrays in journal.records()] == [n * 100_000 for n in range(5)]
    assert path.read_bytes() == before


def test_replaced_journal_stops_the_sweep_and_is_left_alone(study, tmp_path):
    path = tmp_path / "grid.h5"
    message = (
        r"journal was moved to .*moved\.h5 and replaced by another file during the sweep; its blocks are safe there"
    )
    with pytest.raises(ResultsError, match=message):
        sweep_and_meddle(study, path, lambda path: swap(journal_name(path)), keep="front")
    assert journal_name(path).read_text() == "my thesis"
    with pytest.raises(ResultsError, match=r"grid\.h5\.journal is not a journal, so it is left alone; move it away"):
        explore.sweep(study, path, keep="front")


# --- other programs' files with the names of ours --------------------------------------------------------------------


def test_foreign_lock_is_locked_but_neither_changed_nor_removed(tmp_path):
    """`-o Cargo` meets Cargo.lock."""
    lock = tmp_path / "Cargo.lock"
    lock.write_text("# generated by cargo\nversion = 3\n")
    path = tmp_path / "Cargo"
    with writer(path) as store:
        store.commit(0, values(0))
        with pytest.raises(ResultsError, match="is being written by another process; wait"), LockFile(path):
            pytest.fail("two hold the lock")
    assert lock.read_text() == "# generated by cargo\nversion = 3\n"


@pytest.mark.parametrize("text", ["", "process 12 on host h", "process 1", "pro", "\0\0\0\0"])
def test_lock_that_a_holder_left_is_removed(tmp_path, text):
    lock = tmp_path / "grid.h5.lock"
    lock.write_text(text)
    fill(tmp_path / "grid.h5", [0])
    assert not lock.exists()


@pytest.mark.parametrize("name", ["lock", "journal", "log.jsonl"])
@pytest.mark.parametrize("kind", ["link", "fifo", "folder"])
@pytest.mark.parametrize("keep", ["all", "front"])
def test_links_pipes_and_folders_in_place_of_its_files_are_refused(study, tmp_path, name, kind, keep):
    path, target = tmp_path / "grid.h5", tmp_path / "thesis.txt"
    place = tmp_path / f"grid.h5.{name}"
    target.write_text("my thesis")
    {"link": lambda: place.symlink_to(target), "fifo": lambda: os.mkfifo(place), "folder": place.mkdir}[kind]()
    before = place.lstat()
    what = {"link": "a link", "fifo": "a pipe or a device", "folder": "a folder"}[kind]
    with pytest.raises(ResultsError, match=rf"grid\.h5\.{name} is {what}, not a regular file, so it is left alone"):
        explore.sweep(study, path, keep=keep)
    assert not path.exists()
    assert target.read_text() == "my thesis"
    assert (place.lstat().st_ino, place.lstat().st_mode) == (before.st_ino, before.st_mode)


def test_foreign_log_is_left_alone(study, tmp_path):
    log = log_path(tmp_path / "grid.h5")
    log.write_text("my diary\n")
    with pytest.raises(
        ResultsError, match=r"grid\.h5\.log\.jsonl is not a log of explore, so it is left alone; move it"
    ):
        explore.sweep(study, tmp_path / "grid.h5")
    assert log.read_text() == "my diary\n"
    assert [file.name for file in tmp_path.glob("grid.h5*")] == [log.name]
    log.unlink()
    Log(tmp_path / "grid.h5")("start", block=1)
    Log(tmp_path / "grid.h5")("stop")
    assert log.read_text().count("\n") == 2


@pytest.mark.parametrize("left", [b"", b'{"ti', b"\0" * 300, b"\0\0\0" + b'{"time": "2'])
def test_log_that_a_kill_or_a_power_cut_left_is_continued(tmp_path, left):
    log_path(tmp_path / "grid.h5").write_bytes(left)
    Log(tmp_path / "grid.h5")("start")
    assert b'"event": "start"' in log_path(tmp_path / "grid.h5").read_bytes()


def test_log_that_cannot_be_written_does_not_stop_the_sweep(study, tmp_path):
    def meddle(path):
        log_path(path).unlink()
        log_path(path).mkdir()

    assert sweep_and_meddle(study, tmp_path / "grid.h5", meddle).is_complete
    assert log_path(tmp_path / "grid.h5").is_dir()


def test_restart_moves_no_foreign_journal(study, tmp_path):
    journal = journal_name(tmp_path / "grid.h5")
    journal.write_text("my thesis")
    for keep in ("all", "front"):
        with pytest.raises(ResultsError, match=r"grid\.h5\.journal is not a journal, so it is left alone"):
            explore.sweep(study, tmp_path / "grid.h5", keep=keep, restart=True)
    assert journal.read_text() == "my thesis"


def test_only_unfinished_files_of_ours_are_cleaned_up(tmp_path):
    path = tmp_path / "grid.h5"
    ours = [unfinished_name(path), unfinished_name(journal_name(path))]
    foreign = [
        tmp_path / name for name in ("grid.h5.tmp", "grid.h5.unfinished-draft", "grid.h52.unfinished-" + "0" * 8)
    ]
    for file in (*ours, *foreign):
        file.write_text("my thesis")
    remove_leftovers(path)
    assert sorted(tmp_path.iterdir()) == sorted(foreign)
    fill(path, [0])
    assert sorted(tmp_path.iterdir()) == sorted([path, *foreign])


# --- exports ---------------------------------------------------------------------------------------------------------
#: A folder with a finished sweep.
ranked = swept(STUDY, "grid", give=lambda results: results.path.parent)


EXPORTS = {
    "rank.csv": ("rank", "grid.h5"),
    "rank.parquet": ("rank", "grid.h5"),
    "motion.csv": ("simulate", "grid.toml"),
    "pareto.png": ("plot", "pareto", "grid.h5"),
    "page.html": ("report", "grid.h5"),
    "packed.h5": ("pack", "grid.h5"),
}


@pytest.mark.parametrize("linked", [False, True], ids=["itself", "by a link"])
@pytest.mark.parametrize("kind", [stat.S_IFIFO, stat.S_IFCHR], ids=["fifo", "device"])
@pytest.mark.parametrize("name", EXPORTS)
def test_export_never_replaces_a_pipe_or_a_device(ranked, monkeypatch, tmp_path, name, kind, linked):
    monkeypatch.chdir(ranked)
    place = tmp_path / name
    try:
        os.mknod(place, kind | 0o666, os.makedev(1, 3))  # the device numbers of /dev/null
    except PermissionError:
        assert kind == stat.S_IFCHR, "only the superuser makes devices"
        place.symlink_to("/dev/null")
    output = place
    if linked:
        output = tmp_path / f"link-{name}"
        output.symlink_to(place)
    before = place.lstat()
    command, *arguments = EXPORTS[name]
    assert_refused(call(command, *arguments, "-o", output), (1, 2))
    assert place.lstat() == before
    assert sorted(tmp_path.iterdir()) == sorted({place, output})


def test_errors_of_a_quota_and_of_reserved_space(tmp_path):
    message = r"a\.csv needs more bytes, more than your disk quota leaves in .*; free some space or name another file"
    with pytest.raises(ResultsError, match=message), new_file(tmp_path / "a.csv"):
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))
    message = r"a\.h5 needs 5 bytes, which the file system refuses: No space left"
    with pytest.raises(ResultsError, match=message), new_file(tmp_path / "a.h5", 5):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_the_name_of_a_new_file_is_durable(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(files, "sync_folder", lambda folder: synced.append([*folder.iterdir()]))
    with new_file(tmp_path / "a.csv") as unfinished:
        unfinished.touch()
    assert synced == [[tmp_path / "a.csv"]], "under its name"
