"""The command line as a user meets it: output, exit codes, one clear line for whatever goes wrong."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import explore

SMALL = """mechanism = "crank-rocker"
[parameters]
crank = [100, 150, 200]
coupler = 1083.4236
rocker = 541.7118
ground = 691.7118
speed = [4.2735, 5.9829]
"""
LENGTHS = ["--set", "crank=100", "--set", "coupler=1083.4236", "--set", "rocker=541.7118", "--set", "ground=691.7118"]


def run(*arguments, cwd, code=0):
    """Run `explore` in a process of its own and check its exit code."""
    done = subprocess.run(
        [sys.executable, "-c", "from explore.cli import main; main()", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "COLUMNS": "200", "NO_COLOR": "1"},
        check=False,
    )
    assert "Traceback" not in done.stderr
    assert done.returncode == code, done.stderr
    return done


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A folder with a finished small sweep."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "small.toml").write_text(SMALL)
    run("sweep", "small.toml", cwd=folder)
    return folder


def test_help_needs_no_heavy_package():
    script = (
        "import sys; sys.argv = ['explore', '--help']\n"
        "from explore.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'h5py', 'dask', 'distributed', 'numba', 'pydantic', 'moocore', 'pint',"
        " 'matplotlib'}\n"
        "sys.stderr.write(' '.join(sorted(heavy & set(sys.modules))))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)

    assert done.stderr == ""
    assert "sweep" in done.stdout


@pytest.mark.parametrize(
    "command", ["sweep", "rank", "show", "plot", "verify", "pack", "simulate", "mechanisms", "init"]
)
def test_every_command_has_an_example_in_its_help(command, tmp_path):
    text = run(command, "--help", cwd=tmp_path).stdout
    assert f"Example: explore {command}" in text
    assert "[[" not in text


def test_sweep_again_says_that_nothing_is_left_to_do(swept):
    assert "complete already: 6 designs" in run("sweep", "small.toml", cwd=swept).stderr


def test_a_changed_study_is_refused_with_what_changed(swept):
    (swept / "changed.toml").write_text(SMALL.replace("541.7118", "541.5"))
    before = (swept / "results/small.h5").read_bytes()

    done = run("sweep", "changed.toml", "-o", "results/small.h5", cwd=swept, code=1)

    assert "541.7118" in done.stderr
    assert "541.5" in done.stderr
    assert "--restart" in done.stderr
    assert (swept / "results/small.h5").read_bytes() == before


def test_rank_prints_the_speeds_of_one_linkage_as_one_line(swept):
    done = run("rank", "--metric", "cv", cwd=swept)

    assert "0.453186" in done.stdout
    assert "4.2735, 5.9829" in done.stdout
    assert "2 crank_blocked" in done.stderr
    assert "2 change_point" in done.stderr
    assert "speed changes none" in done.stderr


def test_rank_as_json_and_csv(swept):
    done = run("rank", "--metric", "cv", "--metric", "swing_angle:max", "--json", "-o", "front.csv", cwd=swept)

    records = json.loads(done.stdout)
    assert [record["design"] for record in records] == [0, 1]
    assert records[0]["front"] == 1
    assert pd.read_csv(swept / "front.csv")["cv"].tolist() == pytest.approx([r["cv"] for r in records], rel=1e-15)


def test_rank_says_when_nothing_is_feasible(tmp_path):
    (tmp_path / "none.toml").write_text(SMALL + "[constraints]\nswing_angle = { min = 170 }\n")
    run("sweep", "none.toml", cwd=tmp_path)

    done = run("rank", cwd=tmp_path)

    assert "no design of results/none.h5 is feasible" in done.stderr
    assert "2 miss the constraint on swing_angle" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("design", "status", "sentence"),
    [(0, "ok", "computed"), (2, "change_point", "fall into one line"), (4, "crank_blocked", "cannot turn fully")],
)
def test_show_says_the_status_in_words_and_never_a_number(swept, design, status, sentence):
    done = run("show", "--design", design, cwd=swept)
    record = json.loads(run("show", "--design", design, "--json", cwd=swept).stdout)

    assert f"{status}: " in done.stdout
    assert sentence in done.stdout
    assert record["status"] == status
    assert (record["cv"] is None) == (status != "ok")
    assert (record["swing_angle"] is None) == (status != "ok")


def test_show_lists_columns_with_units_and_counts(swept):
    done = run("show", cwd=swept)
    record = json.loads(run("show", "--json", cwd=swept).stdout)

    assert "rad^2/s^4" in done.stdout
    assert all(line == line.rstrip() for line in done.stdout.splitlines()), "blanks at the ends of lines"
    titles = [line for line in done.stdout.splitlines() if line.lstrip().startswith("column ")]
    assert titles[0].index("unit") == next(
        line.index("mm") for line in done.stdout.splitlines() if line.startswith(" crank ")
    ), "units are texts and stand at the left"
    assert record["counts"] == {"ok": 2, "crank_blocked": 2, "change_point": 2}
    assert record["complete"]


def test_simulate_writes_csv_and_json(tmp_path):
    run("simulate", "--mechanism", "crank-rocker", *LENGTHS, "-o", "motion.csv", cwd=tmp_path)
    piped = run("simulate", "--mechanism", "crank-rocker", *LENGTHS, "--json", cwd=tmp_path)

    with (tmp_path / "motion.csv").open(newline="") as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]
    assert len(rows) == 360
    assert rows[90]["crank_angle"] == 90.0
    # The start of the published simulation, solved with 16 digits; degrees and the file's decimals round once each.
    assert np.deg2rad(rows[90]["rocker_angle"]) == pytest.approx(0.8832418337186799, rel=1e-15)
    assert rows[90]["rocker_velocity"] == pytest.approx(0.3196463394567266, rel=1e-15)
    assert [row["rocker_velocity"] for row in rows] == json.loads(piped.stdout)["rocker_velocity"]


def test_simulate_takes_units_and_a_design_of_a_study(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)

    done = run("simulate", "small.toml", "--design", 1, "--angles", 4, cwd=tmp_path)
    other = run(
        "simulate", "--mechanism", "crank-rocker", *LENGTHS, "--set", "speed=5.9829 rad/s", "--angles", 4, cwd=tmp_path
    )

    assert "speed = 5.9829" in done.stderr
    assert done.stdout == other.stdout


def test_mechanisms_lists_everything_with_units(tmp_path):
    assert "crank-rocker" in run("mechanisms", cwd=tmp_path).stdout
    one = run("mechanisms", "crank-rocker", cwd=tmp_path).stdout
    record = json.loads(run("mechanisms", "crank-rocker", "--json", cwd=tmp_path).stdout)

    for word in ("crank", "rad/s^2", "swing_angle", "extended_to_overlapped", "clutch"):
        assert word in one
    assert record["parameters"]["speed"] == {"unit": "rad/s", "default": 1.0, "meaning": "constant crank velocity"}


def test_the_starter_study_runs_and_is_never_overwritten(tmp_path):
    run("init", cwd=tmp_path)
    run("sweep", "study.toml", cwd=tmp_path)
    assert "Pareto" in run("rank", cwd=tmp_path).stdout
    text = (tmp_path / "study.toml").read_text()

    assert "exists" in run("init", cwd=tmp_path, code=2).stderr
    assert (tmp_path / "study.toml").read_text() == text


def test_the_line_after_init_can_be_copied(tmp_path):
    assert run("init", "my study.toml", cwd=tmp_path).stderr.endswith("now run: explore sweep 'my study.toml'\n")


def test_a_full_disk_is_said_in_words(swept):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "explore", "show"], cwd=swept, stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert (done.returncode, done.stderr) == (1, b"error: No space left on device\n")


def test_dry_run_shows_designs_and_writes_nothing(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)

    done = run("sweep", "small.toml", "--dry-run", cwd=tmp_path)

    assert "6 designs (grid)" in done.stderr
    assert "of computing with" in done.stderr
    assert "1083.42" in done.stdout
    assert list(tmp_path.iterdir()) == [tmp_path / "small.toml"]


def test_a_trillion_designs_can_be_planned_at_once_but_not_swept(tmp_path):
    (tmp_path / "big.toml").write_text(
        SMALL.replace("[100, 150, 200]", "{ start = 1, stop = 200, num = 1000000000000 }")
    )

    assert "2,000,000,000,000 designs" in run("sweep", "big.toml", "--dry-run", cwd=tmp_path).stderr
    done = run("sweep", "big.toml", cwd=tmp_path, code=1)

    assert "bytes, but only" in done.stderr
    assert list((tmp_path / "results").glob("*")) == []


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["rank"], 1, "no results yet"),
        (["show"], 1, "no results yet"),
        (["rank", "missing.h5"], 1, "missing.h5"),
        (["sweep", "missing.toml"], 2, "missing.toml"),
        (["rank", "text.h5"], 1, "text.h5"),
        (["show", "empty.h5"], 1, "empty.h5"),
        (["simulate"], 2, "either a study or --mechanism"),
        (["simulate", "--mechanism", "crank-rokcer"], 2, "did you mean 'crank-rocker'"),
        (["simulate", "--mechanism", "crank-rocker", "--set", "crank"], 2, "NAME=VALUE"),
        (["simulate", "--mechanism", "crank-rocker", "--set", "crnak=1"], 2, "crank"),
        (["simulate", "--mechanism", "crank-rocker", *LENGTHS, "--set", "crank=200"], 1, "cannot turn fully"),
        (["mechanisms", "six-bar"], 2, "six-bar"),
        (["sweep"], 2, "CONFIG"),
        (["swep"], 2, "No such command"),
    ],
)
def test_bad_input_gets_one_clear_line(tmp_path, arguments, code, message):
    (tmp_path / "text.h5").write_text("not HDF5")
    (tmp_path / "empty.h5").write_bytes(b"")
    before = sorted(tmp_path.iterdir())

    done = run(*arguments, cwd=tmp_path, code=code)

    assert message in done.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_all_errors_of_a_config_come_at_once_with_their_lines(tmp_path):
    (tmp_path / "bad.toml").write_text(SMALL.replace("rocker =", "roker =") + '[evaluate]\nwindow = "drvie"\n')

    done = run("sweep", "bad.toml", cwd=tmp_path, code=2)

    assert "bad.toml:5: parameters.roker" in done.stderr
    assert "bad.toml:9: evaluate.window" in done.stderr
    assert not (tmp_path / "results").exists()


def test_unknown_metrics_and_designs_of_results_get_one_line(swept):
    assert "did you mean 'cv'" in run("rank", "--metric", "cvv", cwd=swept, code=2).stderr
    assert "0 to 5" in run("show", "--design", "6", cwd=swept, code=1).stderr


def test_a_folder_that_cannot_be_written_gets_one_line(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "results").write_text("a file where the folder should be")

    done = run("sweep", "small.toml", cwd=tmp_path, code=1)

    assert "results" in done.stderr


def test_an_interrupted_sweep_says_how_to_go_on(tmp_path):
    import signal
    import time

    (tmp_path / "long.toml").write_text(SMALL.replace("[100, 150, 200]", "{ start = 1, stop = 140, num = 2000000 }"))
    process = subprocess.Popen(
        [sys.executable, "-c", "from explore.cli import main; main()", "sweep", "long.toml"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    results = tmp_path / "results/long.h5"
    while not (results.exists() and explore.open_results(results).n_committed) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)

    assert process.returncode == 130, errors
    assert "To go on: explore sweep long.toml" in errors
    assert "Traceback" not in errors
    done = run("sweep", "long.toml", cwd=tmp_path)
    assert "were there" in done.stderr
    assert "4,000,000" in run("show", cwd=tmp_path).stdout


def test_another_ranking_in_the_study_is_pointed_out(swept):
    (swept / "other.toml").write_text(SMALL + '[rank]\nmetrics = ["cv", "time_ratio:min"]\n')

    done = run("sweep", "other.toml", "-o", "results/small.h5", cwd=swept)

    assert "explore rank results/small.h5 --metric cv:min --metric time_ratio:min" in done.stderr


@pytest.mark.parametrize("aim", ["design:min", "status:max", "linkage_class:min", "feasible:max", ""])
def test_codes_and_bookkeeping_are_no_aims(swept, aim):
    assert "no column" in run("rank", "--metric", aim, cwd=swept, code=2).stderr


def test_lengths_are_aims_too(swept):
    assert "crank" in run("rank", "--metric", "crank:min", "--metric", "cv", cwd=swept).stdout


@pytest.mark.parametrize("extra", [[], ["--restart"]])
def test_nothing_but_results_is_ever_replaced(tmp_path, extra):
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "notes.h5").write_text("my notes")
    (tmp_path / "folder").mkdir()

    assert "the study itself" in run("sweep", "small.toml", "-o", "small.toml", *extra, cwd=tmp_path, code=2).stderr
    for other in ("notes.h5", "folder"):
        done = run("sweep", "small.toml", "-o", other, *extra, cwd=tmp_path, code=1)
        assert "name another file" in done.stderr
        assert "--restart" not in done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "notes.h5", "small.toml"]


def test_numbers_are_whole_on_a_narrow_terminal(swept):
    script = "from explore.cli import main; main()"
    done = subprocess.run(
        ["script", "-qec", f"stty cols 40; {sys.executable} -c '{script}' rank --metric cv", "/dev/null"],
        cwd=swept,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "TERM": "xterm", "NO_COLOR": "1"},
    )

    assert "0.453186" in done.stdout
    assert "…" not in done.stdout.split("best cv first")[1]


def test_settings_take_the_place_of_the_studys(swept):
    done = run("simulate", "small.toml", "--set", "crank=9 cm", "--angles", 2, cwd=swept)
    other = run("simulate", "--mechanism", "crank-rocker", *LENGTHS, "--set", "crank=90", "--set", "speed=4.2735",
                "--angles", 2, cwd=swept)  # fmt: skip

    assert done.stdout == other.stdout
    assert done.stderr.startswith("design 0 of 6: crank = 100, ")
    assert done.stderr.endswith(", but crank = 90\n")
    wrong = run("simulate", "small.toml", "--set", "crank=3 kg", cwd=swept, code=2)
    assert wrong.stderr == "error: --set crank=3 kg: 'kg' does not measure the same as 'mm'; use mm, cm, m or in\n"


def test_the_package_runs_as_a_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "explore", "--version"], capture_output=True, text=True, check=True, cwd=tmp_path
    )

    assert done.stdout.startswith("explore ")
