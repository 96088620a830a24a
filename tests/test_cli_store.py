"""`explore pack` and `explore verify` as a user meets them, and the commands that read packed and kept files."""

import json
import os
from pathlib import Path

import h5py
import pytest
from command_line import assert_refused, call, on_terminal, run
from store_files import BLOCK, N_BLOCKS, N_DESIGNS, fill, flip, writer
from studies import FEW
from test_store_front import SOME, keep


def damage(path, blocks):
    with h5py.File(path) as file:
        offset = file["designs/nodes"].id.get_offset()
    for number in blocks:
        flip(path, offset + 4 * (number * BLOCK + 17))


def test_a_packed_copy_reads_like_the_original(copy):
    folder = copy.parent
    output = run("pack", "copy.h5", cwd=folder)
    assert output.stdout == ""
    assert output.stderr == "0.4 MB -> 0.1 MB, 2.7 times smaller: copy.packed.h5\n"
    assert sorted(p.name for p in folder.iterdir()) == ["copy.h5", "copy.packed.h5"]
    for command in (
        ["show", "--design", "42", "--json"], ["rank", "--metric", "rocker_velocity_max:max", "--metric", "crank:min"]
    ):  # fmt: skip
        plain, packed = (run(command[0], name, *command[1:], cwd=folder) for name in ("copy.h5", "copy.packed.h5"))
        assert packed.stdout == plain.stdout
        assert plain.stdout
    assert "9,500 designs, complete, packed" in run("show", "copy.packed.h5", cwd=folder).stdout
    plain, packed = (json.loads(run("show", n, "--json", cwd=folder).stdout) for n in ("copy.h5", "copy.packed.h5"))
    assert packed == plain | {"path": "copy.packed.h5", "packed": True}


def test_the_newest_results_exclude_packed_copies(copy):
    folder = copy.parent
    (folder / "results").mkdir()
    copy.rename(folder / "results/b.h5")
    run("pack", cwd=folder)
    assert json.loads(run("show", "--json", cwd=folder).stdout)["path"] == "results/b.h5"
    fill(folder / "results/a.h5", [1])
    os.utime(folder / "results/a.h5", (0, 0))
    output = run("show", "--json", cwd=folder)
    assert json.loads(output.stdout)["path"] == "results/b.h5"
    assert output.stderr == "results/b.h5 is the newest of 2 results\n"
    (folder / "results/b.h5").unlink()
    assert json.loads(run("show", "--json", cwd=folder).stdout)["path"] == "results/b.packed.h5"


def test_an_unfinished_front_may_be_the_newest(copy):
    folder = copy.parent
    (folder / "results").mkdir()
    copy.rename(folder / "results/b.h5")
    os.utime(folder / "results/b.h5", (0, 0))
    (folder / "results/front.h5.journal").write_bytes(b"")
    assert "results/front.h5 is not finished" in run("show", cwd=folder, code=1).stderr


def test_pack_into_a_named_file(copy):
    run("pack", "copy.h5", "-o", "new/small.h5", cwd=copy.parent)
    output = run("pack", "copy.h5", "-o", "new/small.h5", cwd=copy.parent, code=1)
    assert output.stderr == "error: new/small.h5 exists already; name another file with -o\n"


def test_verify_sound_files(copy):
    fill(copy.parent / "part.h5", [1, 9])
    run("pack", "copy.h5", cwd=copy.parent)
    for name in ("copy.h5", "copy.packed.h5"):
        lines = run("verify", name, cwd=copy.parent).stdout.splitlines()
        assert lines[0] == f"{name}: 10 blocks committed, 0 pending, 0 damaged; 9,500 designs"
        assert lines[-1] == "every committed block is sound; finished"
        assert any(line.split() == ["crank_blocked", "1,357"] for line in lines)
    lines = run("verify", "part.h5", cwd=copy.parent).stdout.splitlines()
    assert lines[0] == "part.h5: 2 blocks committed, 8 pending, 0 damaged; 1,500 designs"
    assert lines[-1] == "every committed block is sound; not finished: 1,500 of 9,500"
    report = json.loads(run("verify", "part.h5", "--json", cwd=copy.parent).stdout)
    assert report["counts"] == {"ok": 1286, "crank_blocked": 214}
    del report["counts"]
    assert report == {
        "path": "part.h5", "sound": True, "complete": False, "keep": "all", "studied": N_DESIGNS, "designs": N_DESIGNS,
        "committed": 1500, "blocks": N_BLOCKS, "committed_blocks": 2, "pending_blocks": 8, "damaged_blocks": [],
    }  # fmt: skip


def test_verify_names_damaged_blocks(copy):
    damage(copy, [0, 4, 9])
    output = run("verify", "copy.h5", cwd=copy.parent, code=1)
    assert output.stdout.startswith("copy.h5: 10 blocks committed, 0 pending, 3 damaged; 9,500 designs\n")
    assert output.stderr.splitlines() == [
        "error: block 0 is damaged: designs 0 to 999",
        "error: block 4 is damaged: designs 4,000 to 4,999",
        "error: block 9 is damaged: designs 9,000 to 9,499",
        "error: run the sweep or refinement again: it computes the damaged blocks anew and keeps the others",
    ]
    report = json.loads(run("verify", "copy.h5", "--json", cwd=copy.parent, code=1).stdout)
    assert report["sound"] is False
    assert report["damaged_blocks"][1] == {"block": 4, "first_row": 4000, "last_row": 4999}
    assert sum(report["counts"].values()) == N_DESIGNS - 2500, "damaged blocks are not counted"


def test_verify_a_damaged_packed_file(packed_copy):
    with h5py.File(packed_copy) as file:
        info = file["designs/status"].id.get_chunk_info(4)
    flip(packed_copy, info.byte_offset + info.size - 1)
    output = run("verify", "copy.h5", cwd=packed_copy.parent, code=1)
    assert output.stderr.splitlines() == [
        "error: block 4 is damaged: designs 4,000 to 4,999",
        "error: restore the file from a copy, or pack the original again",
    ]
    packed_copy.write_bytes(packed_copy.read_bytes()[:-1000])
    output = run("verify", "copy.h5", cwd=packed_copy.parent, code=1)
    assert output.stderr.startswith("error: copy.h5 is cut short and cannot be read")


def test_verify_a_running_sweep(tmp_path):
    with writer(tmp_path / "grid.h5"):
        output = run("verify", "grid.h5", cwd=tmp_path)
    assert "0 blocks committed, 10 pending, 0 damaged; 0 designs" in output.stdout


def test_one_block_is_singular(tmp_path):
    fill(tmp_path / "one.h5", [3])
    assert run("verify", "one.h5", cwd=tmp_path).stdout.startswith("one.h5: 1 block committed, 9 pending, ")


def test_show_and_verify_of_a_front(tmp_path):
    keep(tmp_path / "kept.h5", SOME)
    lines = run("show", "kept.h5", cwd=tmp_path).stdout.splitlines()
    assert lines[0] == "kept.h5: unknown mechanism, 9,500 designs, complete"
    assert lines[1] == "7 of 9,500 designs were kept, the Pareto-optimal ones"
    assert any(line.split()[:2] == ["crank_blocked", "1,358"] for line in lines)
    assert json.loads(run("show", "kept.h5", "--json", cwd=tmp_path).stdout)["studied"] == N_DESIGNS
    assert json.loads(run("show", "kept.h5", "--design", "4321", "--json", cwd=tmp_path).stdout)["crank"] == 4321.25
    output = run("show", "kept.h5", "--design", "4320", cwd=tmp_path, code=1)
    problem = "kept.h5: design 4320 is not Pareto-optimal and was not kept"
    assert output.stderr == f"error: {problem}; sweep with --keep all to keep every design\n"
    assert "finished" in run("verify", "kept.h5", cwd=tmp_path).stdout


@pytest.mark.parametrize(("command", "activity"), [("pack", "packing"), ("verify", "checking")])
def test_bar_on_a_terminal(copy, command, activity):
    """On a terminal a bar appears on stderr while the answer stays the same."""
    output, terminal_text = on_terminal(command, "copy.h5", cwd=copy.parent)
    assert activity in terminal_text
    assert "100%" in terminal_text
    assert ("10 blocks committed" in output) == (command == "verify")


@pytest.mark.parametrize(
    "command", [["rank"], ["show"], ["show", "--design", "1"], ["plot", "pareto"], ["report"], ["verify"], ["pack"]]
)
def test_a_study_in_place_of_its_results_is_reported(in_results, command):
    Path("small.toml").write_text(FEW)
    Path("my other.toml").write_text(FEW)
    before = sorted(in_results.rglob("*"))
    words = "is a study, not its results;"
    assert_refused(call(*command, "small.toml"), 1, f"error: small.toml {words} did you mean results/small.h5?\n")
    assert_refused(call(*command, "my other.toml"), 1, f"error: my other.toml {words} sweep it first\n")
    assert sorted(in_results.rglob("*")) == before
