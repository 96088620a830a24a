"""`explore synthesize`: from a task to results that the other commands read."""

import json
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from command_line import run
from stopping import interrupt

import explore
from explore.cli.commands.synthesize import _best_first, _order
from explore.synthesis.paths import search
from explore.synthesis.paths.search import find_paths
from explore.synthesis.tasks.task_files import TaskFile

TASK = """task = "dead-positions"
[target]
swing_angle = 40
time_ratio = 1.25
ground = 100
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "swing.toml").write_text(TASK, encoding="utf-8")
    return tmp_path


def test_candidates_are_printed_best_first_and_written(folder):
    output = run("synthesize", "swing.toml", cwd=folder)
    assert "searched both families of crank-rockers of swing 40 deg and time ratio 1.25" in output.stderr
    assert output.stderr.endswith("wrote results/swing.h5; now run: explore rank results/swing.h5\n")
    assert "20 candidates, 20 within the bounds, best transmission_angle_worst first" in output.stdout
    first = next(line for line in output.stdout.splitlines() if line.strip().startswith("0 "))
    assert first.split()[:5] == ["0", "42.8078", "16338.1", "1", "with_rocker"]
    assert "with_rocker: the crank turns by more than half a turn" in output.stdout


def test_the_other_commands_work_on_the_candidates(folder):
    run("synthesize", "swing.toml", cwd=folder)
    assert "42.8078" in run("rank", cwd=folder).stdout
    assert "with_rocker" in run("show", "--design", "0", cwd=folder).stdout
    run("report", "results/swing.h5", "-o", "swing.html", cwd=folder)
    run("export", "results/swing.h5", "--design", "0", "-o", "swing.dxf", "-o", "design.toml", cwd=folder)
    assert "finished" in run("verify", "results/swing.h5", cwd=folder).stdout
    run("sweep", "design.toml", cwd=folder)
    (swing,) = explore.read_results(folder / "results" / "design.h5")["swing_angle"]
    assert swing == pytest.approx(40, rel=1e-13)


def test_a_refinement_improves_the_candidates_within_the_task(folder):
    run("synthesize", "swing.toml", cwd=folder)
    output = run("refine", "results/swing.h5", "--evaluations", "4096", cwd=folder)
    assert "the front grew" in output.stderr
    best = explore.rank(folder / "results" / "swing-refined.h5")
    assert best["swing_angle"].between(39.9, 40.1).all()
    assert best["transmission_angle_worst"].max() > 42.8079


def test_the_same_task_again_changes_nothing_and_another_is_refused(folder):
    run("synthesize", "swing.toml", cwd=folder)
    before = (folder / "results" / "swing.h5").read_bytes()
    run("synthesize", "swing.toml", cwd=folder)
    assert (folder / "results" / "swing.h5").read_bytes() == before
    (folder / "swing.toml").write_text(TASK.replace("40", "50"), encoding="utf-8")
    refused = run("synthesize", "swing.toml", cwd=folder, code=1)
    assert "holds the results of another study" in refused.stderr
    assert "--restart" in refused.stderr
    assert (folder / "results" / "swing.h5").read_bytes() == before
    run("synthesize", "swing.toml", "--restart", cwd=folder)
    assert (folder / "results" / "swing.h5.old").read_bytes() == before


def test_another_task_is_refused_before_the_search(folder, monkeypatch):
    explore.synthesize(folder / "swing.toml", folder / "a.h5")
    monkeypatch.setattr(TaskFile, "find", lambda *_: pytest.fail("searched"))
    (folder / "swing.toml").write_text(TASK.replace("40", "50"), encoding="utf-8")
    with pytest.raises(explore.ResultsError, match="\n  .*swing_angle: .*40.* -> .*50"):
        explore.synthesize(folder / "swing.toml", folder / "a.h5")


def test_json_has_all_candidates_best_first(folder):
    record = json.loads(run("synthesize", "swing.toml", "--json", "--quiet", cwd=folder).stdout)
    angles = [candidate["transmission_angle_worst"] for candidate in record["candidates"]]
    assert angles == sorted(angles, reverse=True)
    assert record["candidates"][0]["family_label"] == "with_rocker"
    assert record["tried"] == ["searched both families of crank-rockers of swing 40 deg and time ratio 1.25"]


def test_a_dry_run_says_what_would_be_searched_and_writes_nothing(folder):
    text = run("synthesize", "swing.toml", "--dry-run", cwd=folder).stdout
    assert "swing.toml: dead-positions, candidates of a crank-rocker -> results/swing.h5" in text
    assert "transmission_angle_worst at least 20" in text
    record = json.loads(run("synthesize", "swing.toml", "--dry-run", "--json", cwd=folder).stdout)
    assert record["objectives"] == ["transmission_angle_worst:max", "footprint:min"]
    assert [path.name for path in folder.iterdir()] == ["swing.toml"]


def test_results_in_the_units_of_the_task(folder):
    (folder / "swing.toml").write_text(TASK + '[units]\nlength = "in"\nangle = "rad"\n', encoding="utf-8")
    output = run("synthesize", "swing.toml", cwd=folder)
    assert "0.747137" in output.stdout  # 42.8078 deg in rad


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TASK.replace("40", "400"), "target.swing_angle: must be above 0 and below 180 deg, got 400"),
        ("task = ", "swing.toml:1: not TOML"),
        ('mechanism = "crank-rocker"', "this is a study; run it with `explore sweep`"),
    ],
)
def test_a_wrong_task_is_one_line_and_writes_nothing(folder, text, message):
    (folder / "swing.toml").write_text(text, encoding="utf-8")
    output = run("synthesize", "swing.toml", cwd=folder, code=2)
    (line,) = output.stderr.splitlines()
    assert message in line
    assert [path.name for path in folder.iterdir()] == ["swing.toml"]


def test_a_task_is_not_swept(folder):
    (line,) = run("sweep", "swing.toml", cwd=folder, code=2).stderr.splitlines()
    assert line == "error: swing.toml: this is a task; run it with `explore synthesize`"


def test_the_task_itself_is_not_overwritten(folder):
    assert "is the task itself" in run("synthesize", "swing.toml", "-o", "swing.toml", cwd=folder, code=2).stderr
    assert (folder / "swing.toml").read_text(encoding="utf-8") == TASK


def test_an_interrupted_search_writes_nothing(folder, monkeypatch):
    monkeypatch.setattr("explore.synthesis.tasks.task_files.TaskFile.find", interrupt)
    output = run("synthesize", "swing.toml", "-o", "swing.h5", cwd=folder, code=130)
    assert output.stderr.endswith("interrupted; nothing was written\n")
    assert not Path(folder / "swing.h5").exists()


def test_init_writes_a_task(tmp_path):
    assert run("init", "--task", "dead-positions", cwd=tmp_path).stderr == (
        "wrote task.toml; now run: explore synthesize task.toml\n"
    )
    assert (tmp_path / "task.toml").read_text(encoding="utf-8").startswith("# A task")
    assert (
        "did you mean 'dead-positions'?"
        in run("init", "x.toml", "--task", "dead-position", cwd=tmp_path, code=2).stderr
    )
    both = run("init", "x.toml", "--task", "dead-positions", "--mechanism", "gears", cwd=tmp_path, code=2)
    assert "--mechanism and --task are given; name one of them" in both.stderr
    assert not (tmp_path / "x.toml").exists()


def test_candidates_that_pass_come_before_those_with_a_smaller_error():
    """Errors of exact candidates are rounding, which put one of another circuit first."""
    frame = pd.DataFrame({
        "path_error_rms": [1e-12, 3e-10, 2e-10, 5.0], "passage": [3, 0, 0, 0], "feasible": [True, True, True, False],
    })  # fmt: skip
    results = SimpleNamespace(to_pandas=lambda: frame, objectives=["path_error_rms:min"])
    assert list(_best_first(results).index) == [2, 1, 0, 3]
    assert _order(frame, "path_error_rms") == "those that pass first, then by path_error_rms"
    assert _order(frame[1:], "path_error_rms") == "best path_error_rms first"
    frame["feasible"] = False
    assert list(_best_first(results).index) == [2, 1, 3, 0]
    swing = SimpleNamespace(to_pandas=lambda: frame.drop(columns="passage"), objectives=["path_error_rms:max"])
    assert list(_best_first(swing).index) == [3, 1, 2, 0]


def test_an_interrupted_search_of_a_path_keeps_what_was_found(tmp_path, monkeypatch):
    given = iter([True])

    def once(*arguments, **named):
        if next(given, False):
            return find_paths(*arguments, **named)
        raise KeyboardInterrupt

    monkeypatch.setattr(search, "find_paths", once)
    task = tmp_path / "oval.toml"
    points = [[40, 0], [28, 14], [0, 21], [-30, 14], [-39, 1], [-27, -15], [1, -20], [29, -13]]
    task.write_text(f'task = "path"\n[target]\npoints = {points}\nclosed = true\n[search]\ncount = 4\n', "utf-8")
    output = run("synthesize", "oval.toml", "-o", "oval.h5", cwd=tmp_path, code=130)
    assert "interrupted: these were found so far" in output.stderr
    assert ", and of " not in output.stderr
    assert len(explore.read_results(tmp_path / "oval.h5")) > 0

    given = iter([True])
    with pytest.raises(KeyboardInterrupt):
        explore.synthesize(task, tmp_path / "python.h5")
    assert len(explore.read_results(tmp_path / "python.h5")) > 0
