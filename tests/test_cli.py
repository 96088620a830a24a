"""The command line as a user meets it: output, exit codes, one clear line for whatever goes wrong."""

import asyncio
import csv
import gc
import json
import logging
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from command_line import COMMANDS, run
from studies import GOOD, crank_rockers
from waiting import wait_until

import explore
from explore.base.json_text import json_text
from explore.cli.application import app
from explore.cli.commands import sweep
from explore.cli.output import count_of, is_or_are, number, printable, shown_unit
from explore.running.timing import seconds_per_design

SMALL = crank_rockers([100, 150, 200], speed=[4.2735, 5.9829])
LENGTHS = ["--set", "crank=100", "--set", "coupler=1083.4236", "--set", "rocker=541.7118", "--set", "ground=691.7118"]


@pytest.fixture(scope="module")
def sweep_folder(tmp_path_factory):
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
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)

    assert output.stderr == ""
    assert "sweep" in output.stdout


def test_ranking_does_not_load_the_compiler():
    script = "import sys, explore.results.ranking.rankings, explore.cli.commands.rank; print('numba' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout == "False\n"


def test_a_command_ends_without_a_search_for_garbage():
    """What is frozen is not searched; the first function registered for the end runs last."""
    script = (
        "import atexit, gc, sys\n"
        "atexit.register(lambda: print(gc.get_threshold()[0], gc.get_freeze_count()))\n"
        "from explore.cli import main\n"
        "sys.argv = ['explore', '--version']\n"
        "main()\n"
    )
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    threshold, frozen = map(int, output.split()[-2:])
    assert threshold > 10_000
    assert frozen > 10_000


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_an_example_in_its_help(command, tmp_path):
    text = run(command, "--help", cwd=tmp_path).stdout
    assert f"Example: explore {command}" in text
    assert "[[" not in text


FLAGS = {
    name: [max(p.opts, key=len) for p in command.params if getattr(p, "is_flag", False)]
    for name, command in typer.main.get_command(app).commands.items()
}


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_flags_have_no_placeholder_in_the_help(command, tmp_path):
    text = run(*command.split(), "--help", cwd=tmp_path).stdout
    for flag in [*(FLAGS[command] if command else ["--version"]), "--help"]:
        (line,) = (line for line in text.splitlines() if line.split()[1:2] == [flag])
        assert "<" not in line
        assert "BOOL" not in line.upper()
    assert "<" in text or not command, "a value says of which kind it is"


def test_sweep_again_says_that_nothing_is_left_to_do(sweep_folder):
    assert "complete already: 6 designs" in run("sweep", "small.toml", cwd=sweep_folder).stderr


def test_rank_prints_the_speeds_of_one_linkage_as_one_line(sweep_folder):
    output = run("rank", "--metric", "cv", cwd=sweep_folder)

    assert "0.453186" in output.stdout
    assert "4.2735, 5.9829" in output.stdout
    assert "2 crank_blocked" in output.stderr
    assert "2 change_point" in output.stderr
    assert "speed changes none" in output.stderr


def test_rank_says_nothing_of_a_speed_that_is_fixed(tmp_path):
    (tmp_path / "fixed.toml").write_text(crank_rockers([100, 150], speed=4.2735))
    run("sweep", "fixed.toml", cwd=tmp_path)
    assert "changes none" not in run("rank", "--metric", "cv", cwd=tmp_path).stderr


def test_rank_as_json_and_csv(sweep_folder):
    output = run("rank", "--metric", "cv", "--metric", "swing_angle:max", "--json", "-o", "front.csv", cwd=sweep_folder)

    records = json.loads(output.stdout)
    assert [record["design"] for record in records] == [0, 1]
    assert records[0]["front"] == 1
    assert pd.read_csv(sweep_folder / "front.csv")["cv"].tolist() == pytest.approx(
        [r["cv"] for r in records], rel=1e-15
    )


def test_rank_says_when_nothing_is_feasible(tmp_path):
    (tmp_path / "none.toml").write_text(SMALL + "[constraints]\nswing_angle = { min = 170 }\n")
    run("sweep", "none.toml", cwd=tmp_path)

    output = run("rank", cwd=tmp_path)

    assert "no design of results/none.h5 is feasible" in output.stderr
    assert "2 miss the constraint on swing_angle" in output.stderr
    assert output.stdout == ""


@pytest.mark.parametrize(
    ("design", "status", "sentence"),
    [(0, "ok", "computed"), (2, "change_point", "fall into one line"), (4, "crank_blocked", "cannot turn fully")],
)
def test_show_says_the_status_in_words_and_never_a_number(sweep_folder, design, status, sentence):
    output = run("show", "--design", design, cwd=sweep_folder)
    record = json.loads(run("show", "--design", design, "--json", cwd=sweep_folder).stdout)

    assert f"{status}: " in output.stdout
    assert sentence in output.stdout
    assert record["status"] == record["status_label"] == status
    assert (record["cv"] is None) == (status != "ok")
    assert (record["swing_angle"] is None) == (status != "ok")


def test_show_lists_columns_with_units_and_counts(sweep_folder):
    output = run("show", cwd=sweep_folder)
    record = json.loads(run("show", "--json", cwd=sweep_folder).stdout)

    assert "rad^2/s^4" in output.stdout
    assert all(line == line.rstrip() for line in output.stdout.splitlines()), "blanks at the ends of lines"
    titles = [line for line in output.stdout.splitlines() if line.lstrip().startswith("column ")]
    assert titles[0].index("unit") == next(
        line.index("mm") for line in output.stdout.splitlines() if line.startswith(" crank ")
    ), "units are texts and stand at the left"
    assert record["counts"] == {"ok": 2, "crank_blocked": 2, "change_point": 2}
    assert record["complete"]


def test_simulate_writes_csv_and_json(tmp_path):
    run("simulate", "--mechanism", "crank-rocker", *LENGTHS, "-o", "motion.csv", cwd=tmp_path)
    json_output = run("simulate", "--mechanism", "crank-rocker", *LENGTHS, "--json", cwd=tmp_path)

    with (tmp_path / "motion.csv").open(newline="") as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]
    assert len(rows) == 360
    assert rows[90]["crank_angle"] == 90.0
    # The start of the published simulation, solved with 16 digits; degrees and the file's decimals round once each.
    assert np.deg2rad(rows[90]["rocker_angle"]) == pytest.approx(0.8832418337186799, rel=1e-15)
    assert rows[90]["rocker_velocity"] == pytest.approx(0.3196463394567266, rel=1e-15)
    assert [row["rocker_velocity"] for row in rows] == json.loads(json_output.stdout)["rocker_velocity"]


def test_simulate_takes_units_and_a_design_of_a_study(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)

    output = run("simulate", "small.toml", "--design", 1, "--angles", 4, cwd=tmp_path)
    other = run(
        "simulate", "--mechanism", "crank-rocker", *LENGTHS, "--set", "speed=5.9829 rad/s", "--angles", 4, cwd=tmp_path
    )

    assert "speed = 5.9829" in output.stderr
    assert output.stdout == other.stdout


def test_mechanisms_lists_everything_with_units(tmp_path):
    assert "crank-rocker" in run("mechanisms", cwd=tmp_path).stdout
    one = run("mechanisms", "crank-rocker", cwd=tmp_path).stdout
    record = json.loads(run("mechanisms", "crank-rocker", "--json", cwd=tmp_path).stdout)

    for word in ("crank", "rad/s^2", "swing_angle", "extended_to_overlapped", "clutch"):
        assert word in one
    assert "min and max have the sign of the signal, peak is its largest magnitude" in one
    for side in ("min", "max"):
        name = f"transmission_angle_{side}"
        assert f"{name} is a closed-form metric of the full turn; over a window it is, for example, {name}_drive" in one
    assert "crank_blocked" in one
    assert record["statuses"]["crank_blocked"] == "the crank cannot turn fully: the linkage locks before a full turn"
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


def test_init_says_that_there_is_no_folder(tmp_path):
    error = run("init", "nowhere/my.toml", cwd=tmp_path, code=2).stderr
    assert error == "error: nowhere/my.toml: there is no folder nowhere; name another file\n"


def test_a_full_disk_is_reported_in_words(sweep_folder):
    with Path("/dev/full").open("w") as full:
        output = subprocess.run(
            [sys.executable, "-m", "explore", "show"],
            cwd=sweep_folder,
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
        )
    assert (output.returncode, output.stderr) == (1, b"error: No space left on device\n")


def test_dry_run_shows_designs_and_writes_nothing(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)

    output = run("sweep", "small.toml", "--dry-run", cwd=tmp_path)

    assert "6 designs (grid)" in output.stderr
    assert "of computing with" in output.stderr
    assert "1083.42" in output.stdout
    assert list(tmp_path.iterdir()) == [tmp_path / "small.toml"]


def test_dry_run_shows_each_parameter_under_its_name(tmp_path):
    """The study names its parameters in another order than the mechanism declares them."""
    study = 'mechanism = "slider-crank"\n[parameters]\nmass = 2\nspeed = 7\nrod = 120\noffset = -5\ncrank = 30\n'
    (tmp_path / "study.toml").write_text(study)

    lines = run("sweep", "study.toml", "--dry-run", cwd=tmp_path).stdout.splitlines()

    heading = next(line.split() for line in lines if "crank" in line)
    _, *values = next(line.split() for line in lines if line.split()[:1] == ["0"])
    expected = {"crank": "30", "rod": "120", "offset": "-5", "speed": "7", "mass": "2"}
    assert dict(zip(heading, values, strict=True)) == expected


def test_dry_run_leaves_compiling_out_of_its_estimate(monkeypatch):
    def evaluate(_, designs):
        """As slow as compiling at the first call."""
        time.sleep(0.0 if counts else 1.0)
        counts.append(len(designs["crank"]))

    counts = []
    monkeypatch.setattr("explore.running.timing.evaluate_columns", evaluate)
    study = explore.load_study(Path(__file__).parents[1] / "configs/optimum.toml")

    assert seconds_per_design(study) < 1e-4  # with that second it is above
    assert counts == [128, 128, 512, 512, 2048, 2048]


@pytest.mark.parametrize(
    ("text", "seconds", "expected"),
    [
        (SMALL, 0.0, [6, 6]),  # a small study once for compiling and once for the time
        (SMALL.replace("[100, 150, 200]", "{ start = 1, stop = 200, num = 1000 }"), 2e-3, [128, 128]),
    ],
)
def test_dry_run_computes_few_designs_of_small_and_slow_studies(tmp_path, monkeypatch, text, seconds, expected):
    counts = []

    def evaluate(_, designs):
        counts.append(len(designs["crank"]))
        time.sleep(seconds * counts[-1])

    monkeypatch.setattr("explore.running.timing.evaluate_columns", evaluate)
    (tmp_path / "study.toml").write_text(text)
    seconds_per_design(explore.load_study(tmp_path / "study.toml"))
    assert counts == expected


def test_a_trillion_designs_can_be_planned_at_once_but_not_swept(tmp_path):
    (tmp_path / "big.toml").write_text(
        SMALL.replace("[100, 150, 200]", "{ start = 1, stop = 200, num = 1000000000000 }")
    )

    assert "2,000,000,000,000 designs" in run("sweep", "big.toml", "--dry-run", cwd=tmp_path).stderr
    output = run("sweep", "big.toml", cwd=tmp_path, code=1)

    assert "bytes, but only" in output.stderr
    assert list((tmp_path / "results").glob("*")) == []


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["rank"], 1, "no results yet"),
        (["simulate"], 2, "either a study or --mechanism"),
        (["simulate", "--mechanism", "crank-rokcer"], 2, "did you mean 'crank-rocker'"),
        (["simulate", "--mechanism", "crank-rocker", "--set", "crank"], 2, "NAME=VALUE"),
        (["simulate", "--mechanism", "crank-rocker", "--set", "crnak=1"], 2, "crank"),
        (["simulate", "--mechanism", "crank-rocker", *LENGTHS[2:], "--set", "crank=200"], 1, "cannot turn fully"),
        (["simulate", "--mechanism", "crank-rocker", *LENGTHS, "--set", "crank=90"], 2, "--set crank is given several"),
        (["export", "--mechanism", "gears", "--point", "a=1,2", "--point", "a=1,3", "-o", "a.svg"], 2, "--point a is"),
        (["mechanisms", "six-bar"], 2, "six-bar"),
        (["rank", "--where", "crank > 1", "--where", "crank < 2"], 2, "--where is given several times"),
        (["show", "-o", "a.csv", "--output", "b.csv"], 2, "--output is given several times"),
        (["sweep"], 2, "STUDY"),
        (["swep"], 2, "No such command"),
    ],
)
def test_bad_input_gets_one_clear_line(tmp_path, arguments, code, message):
    assert message in run(*arguments, cwd=tmp_path, code=code).stderr
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_sweep_says_how_to_continue(tmp_path):
    (tmp_path / "long.toml").write_text(SMALL.replace("[100, 150, 200]", "{ start = 1, stop = 140, num = 500_000 }"))
    process = subprocess.Popen(
        [sys.executable, "-c", "from explore.cli import main; main()", "sweep", "long.toml"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    results = tmp_path / "results/long.h5"
    wait_until(lambda: results.exists() and explore.open_results(results).n_committed)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=240)

    assert process.returncode == 130, errors
    assert "To continue: explore sweep long.toml" in errors
    assert "Traceback" not in errors
    output = run("sweep", "long.toml", cwd=tmp_path)
    assert "were there" in output.stderr
    assert "1,000,000" in run("show", cwd=tmp_path).stdout


def test_changed_objectives_of_the_study_are_reported(sweep_folder):
    (sweep_folder / "other.toml").write_text(SMALL + '[rank]\nmetrics = ["cv", "time_ratio:min"]\n')

    output = run("sweep", "other.toml", "-o", "results/small.h5", cwd=sweep_folder)

    assert "explore rank results/small.h5 --metric cv:min --metric time_ratio:min" in output.stderr


@pytest.mark.parametrize("objective", ["design:min", "status:max", "linkage_class:min", "feasible:max", ""])
def test_codes_and_bookkeeping_columns_cannot_be_objectives(sweep_folder, objective):
    assert "no column" in run("rank", "--metric", objective, cwd=sweep_folder, code=2).stderr


@pytest.mark.parametrize("extra", [[], ["--restart"]])
def test_only_results_files_are_replaced(tmp_path, extra):
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "notes.h5").write_text("my notes")
    (tmp_path / "folder").mkdir()

    assert "the study itself" in run("sweep", "small.toml", "-o", "small.toml", *extra, cwd=tmp_path, code=2).stderr
    for ending in (".csv", ".parquet", ".toml"):
        output = run("sweep", "small.toml", "-o", f"a{ending}", *extra, cwd=tmp_path, code=2)
        assert f"-o a{ending}: results are HDF5, so the name must not end in {ending}; write a.h5" in output.stderr
    for other in ("notes.h5", "folder"):
        output = run("sweep", "small.toml", "-o", other, *extra, cwd=tmp_path, code=1)
        assert "name another file" in output.stderr
        assert "--restart" not in output.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "notes.h5", "small.toml"]


def test_numbers_are_not_cut_on_a_narrow_terminal(sweep_folder):
    # A width in the environment, which pytest-xdist sets, overrides that of the terminal.
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    environment |= {"TERM": "xterm", "NO_COLOR": "1"}
    script = "from explore.cli import main; main()"
    output = subprocess.run(
        [
            "script",
            "-qec",
            f"stty cols 40; {sys.executable} -c '{script}' rank results/small.h5 --metric cv",
            "/dev/null",
        ],
        cwd=sweep_folder,
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )

    table = re.sub(r"\x1b\[[\d;]*m", "", output.stdout.split("best cv first")[1])
    assert "0.453186" in table
    assert "…" not in table
    assert "5 columns left out: coupler, rocker, ground, speed, transmission_angle_min; " in table
    assert max(map(len, table.partition("columns left out")[0].splitlines())) <= 40


def test_set_replaces_parameters_of_the_study(sweep_folder):
    output = run("simulate", "small.toml", "--set", "crank=9 cm", "--angles", 2, cwd=sweep_folder)
    other = run("simulate", "--mechanism", "crank-rocker", *LENGTHS[2:], "--set", "crank=90", "--set", "speed=4.2735",
                "--angles", 2, cwd=sweep_folder)  # fmt: skip

    assert output.stdout == other.stdout
    assert output.stderr.startswith("design 0 of 6: crank = 100, ")
    assert output.stderr.endswith(", but crank = 90\n")
    error = run("simulate", "small.toml", "--set", "crank=3 kg", cwd=sweep_folder, code=2)
    assert error.stderr == "error: --set crank: 'kg' cannot be converted to 'mm'; use mm, cm, m or in\n"


def test_a_sweep_mutes_the_unfinished_futures_of_event_loops(tmp_path, caplog):
    """dask's loops now and then stop with a future whose exception was not retrieved, which asyncio logs on stderr."""
    (tmp_path / "one.toml").write_text(GOOD)

    def leave_a_future():
        loop = asyncio.new_event_loop()
        loop.create_future().set_exception(TimeoutError("Timeout"))
        loop.close()
        gc.collect()
        return caplog.text

    logging.getLogger("asyncio").setLevel(logging.NOTSET)
    assert "TimeoutError" in leave_a_future()
    assert run("sweep", "one.toml", "--quiet", cwd=tmp_path).stderr == ""
    caplog.clear()
    assert leave_a_future() == ""


def test_durations_and_sizes_have_suitable_units():
    durations = {
        0.5: "a second or less",
        90: "about 90 s",
        120: "about 2 min",
        7_300: "about 2 h",
        2e5: "about 2.3 days",
    }
    assert {seconds: sweep._duration(seconds) for seconds in durations} == durations
    sizes = {2_500_000: "2.5 MB", 1_200_000_000: "1.2 GB", 3.4e12: "3.4 TB"}
    assert {count: sweep._bytes(count) for count in sizes} == sizes


def test_values_as_tables_show_them():
    values = (True, False, math.nan, 0.123456789, 2e-17, 1234567, np.float64(2.0), "ok")
    assert [*map(number, values)] == ["yes", "no", "–", "0.123457", "2e-17", "1,234,567", "2", "ok"]
    assert number(0.123456789, digits=3) == "0.123"
    assert [count_of(n, "block") for n in (0, 1, 2000)] == ["0 blocks", "1 block", "2,000 blocks"]
    assert [is_or_are(n) for n in (0, 1, 2)] == ["are", "is", "are"]
    assert [shown_unit(unit) for unit in ("1", "mm")] == ["", "mm"]
    assert printable("a\tb\x1b[31m\nc") == "a?b?[31m\nc"


def test_json_has_null_for_what_is_no_number():
    assert json.loads(json_text([math.nan, math.inf, -math.inf, 1.5])) == [None, None, None, 1.5]


def test_restart_moves_the_results_aside(tmp_path):
    (tmp_path / "one.toml").write_text(GOOD)
    for options in ([], ["--restart"]):
        run("sweep", "one.toml", "-o", "a.h5", *options, cwd=tmp_path)
    assert (tmp_path / "a.h5.old").exists()
