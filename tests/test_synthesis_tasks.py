"""Task files: what is read, every mistake in one message with its line, and the study of the candidates."""

import re

import numpy as np
import pytest
from command_line import run
from studies import synthesize_text

import explore
from explore.base.errors import ConfigError, RequestError
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import parse_task, task_starter

DEAD = """task = "dead-positions"
[target]
swing_angle = 40
time_ratio = 1.25
"""


def problems_of(text):
    with pytest.raises(ConfigError) as caught:
        parse_task(text, "task.toml")
    return caught.value.problems


def test_names_of_tasks(tmp_path):
    """Also those under which a user looks for them; the help of `explore init` lists all."""
    for name, own in (("poses", "motion"), ("swing", "dead-positions")):
        run("init", f"{name}.toml", "--task", name, cwd=tmp_path)
        text = (tmp_path / f"{name}.toml").read_text(encoding="utf-8")
        assert text == task_starter(own)
        assert parse_task(text.replace(f'task = "{own}"', f'task = "{name}"'), "task.toml").kind == own
    words = run("init", "--help", cwd=tmp_path).stdout
    assert all(re.search(rf"\b{name}\b", words) for name in [*TASK_TYPES, "poses", "swing"])
    with pytest.raises(ConfigError, match=r"task.toml:1: task: unknown task \[\]; write task = \"path\""):
        parse_task("task = []\n", "task.toml")


@pytest.mark.parametrize("name", TASK_TYPES)
def test_starter_runs(name, tmp_path):
    results = synthesize_text(tmp_path, task_starter(name))
    assert results.is_complete
    assert results.attributes["sampler"] == "synthesis"
    assert len(explore.rank(results)) > 0


def test_all_mistakes_at_once_each_with_its_line():
    text = """task = "dead-positions"
[target]
swing = 40
time_ratio = 0.5
[bounds]
transmission_angle_min = "20 mm"
link_ratio_mx = 5
[search]
count = 0
[rnk]
"""
    assert problems_of(text) == [
        "task.toml:3: target.swing: unknown key; did you mean 'swing_angle'?",
        "task.toml:4: target.time_ratio: must be at least 1, got 0.5",
        "task.toml:6: bounds.transmission_angle_min: 'mm' cannot be converted to 'deg'; use deg or rad",
        "task.toml:7: bounds.link_ratio_mx: unknown key; did you mean 'link_ratio_max'?",
        "task.toml:9: search.count: must be a whole number from 1 to 10,000, got 0",
        "task.toml:10: rnk: unknown key; did you mean 'rank'?",
    ]


def test_mistakes_in_the_sections_of_a_study_are_found_before_anything_is_searched():
    text = f"""{DEAD}
[constraints]
swing_angel = {{ min = 3 }}
[evaluate]
metrics = ["footprnt"]
[rank]
metrics = ["time_ratoi"]
[units]
length = "deg"
"""
    lines = problems_of(text)
    assert [line.split(": ")[0:2] for line in lines] == [
        ["task.toml:7", "constraints.swing_angel"],
        ["task.toml:9", "evaluate.metrics"],
        ["task.toml:11", "rank.metrics"],
        ["task.toml:13", "units.length"],
    ]
    assert "did you mean 'time_ratio'?" in lines[2]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "task.toml:1: task: is missing; begin the file with task = \"path\""),
        ('task = "dead-position"', "task.toml:1: task: unknown task 'dead-position'; did you mean 'dead-positions'?"),
        ('task = "dead-positions"\ntarget = 3', "task.toml:2: target: must be a table of keys and values, got 3"),
        (DEAD + "[rank]\nmetrics = []\n", "task.toml:6: rank.metrics: the list is empty; leave it out"),
        ("task = 3", 'task.toml:1: task: unknown task 3; write task = "path"'),
        ("rank = 3\n" + DEAD, "task.toml:1: rank: must be a table of keys and values, got 3"),
        ('mechanism = "crank-rocker"', "task.toml:1: mechanism: this is a study; run it with `explore sweep`"),
        ('task = "dead-positions"', "task.toml:1: target.swing_angle: is missing; write it, such as swing_angle = 40"),
    ],
)  # fmt: skip
def test_one_line_for_each_mistake(text, problem):
    assert any(line.startswith(problem) for line in problems_of(text)), problems_of(text)


@pytest.mark.parametrize("name", ["dead-positions", "dwell", "function", "path", "motion"])
def test_the_study_of_a_task_has_its_bound_on_the_links(name):
    lines = [line for line in task_starter(name).splitlines() if "link_ratio_max" not in line]
    place = lines.index("[bounds]") if "[bounds]" in lines else len(lines)
    lines[place : place + 1] = ["[bounds]", "link_ratio_max = 4"]
    constraint = parse_task("\n".join(lines), "task.toml").task.constraints["link_ratio"]
    assert constraint == {"max": pytest.approx(4.0, rel=1e-8)}  # room for rounding


def test_a_file_that_is_missing():
    with pytest.raises(ConfigError, match="nowhere.toml: no such file"):
        explore.load_task("nowhere.toml")


def test_candidates_have_the_swing_and_the_time_ratio_and_the_best_transmission_angle(tmp_path):
    """42.8078098662 deg is the best of both families, by a scan of another parametrisation with 20 digits."""
    results = synthesize_text(tmp_path, DEAD)
    frame = results.to_pandas()
    assert frame["feasible"].all()
    np.testing.assert_allclose(frame["swing_angle"], 40, rtol=1e-13)
    np.testing.assert_allclose(frame["time_ratio"], 1.25, rtol=1e-13)
    assert frame["transmission_angle_worst"].min() == pytest.approx(20, abs=1e-5)
    assert frame["transmission_angle_worst"].max() == frame["transmission_angle_worst"][0]
    assert frame["transmission_angle_worst"][0] == pytest.approx(42.8078098662, abs=5e-11)
    assert frame["solution"].tolist() == list(range(1, len(frame) + 1))
    assert set(frame["family"]) == {1, -1}


def test_where_nothing_meets_the_bounds_the_nearest_are_rows_that_are_not_feasible(tmp_path):
    text = DEAD + "[bounds]\ntransmission_angle_min = 45\n"
    found = parse_task(text, "task.toml").find()
    assert found.tried[1] == (
        "none has a transmission angle of at least 45 deg and links within a ratio of 10; "
        "the best with links within that ratio has 42.8078 deg"
    )
    results = synthesize_text(tmp_path, text)
    assert not results.to_pandas()["feasible"].any()
    nearest = explore.nearest(results, 1)
    assert nearest["transmission_angle_worst"].iloc[0] == pytest.approx(42.8078098662, abs=5e-11)


def test_a_swing_that_no_linkage_has_with_the_time_ratio():
    task = parse_task(DEAD.replace("1.25", "5"), "task.toml")
    with pytest.raises(
        RequestError, match="no crank-rocker has a swing of 40 deg and a time ratio of 5; change one of the two"
    ):
        task.find()


def random_crank_rockers(count, seed):
    """Crank-rockers with all links within a ratio of 10, and their swing, time ratio and transmission angle."""
    drawn = np.random.default_rng(seed).uniform(0.1, 1.0, (4, 20 * count)) * 100
    names = ("crank", "coupler", "rocker", "ground")
    metrics = ["swing_angle", "time_ratio", "transmission_angle_min", "transmission_angle_max"]
    frame = explore.evaluate("crank-rocker", dict(zip(names, drawn, strict=True)), metrics=metrics)
    frame = frame[frame["feasible"] & frame["swing_angle"].notna()]
    frame = frame[frame[list(names)].min(axis=1) * 10 > frame[list(names)].max(axis=1)]
    return frame.head(count)


@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.slow)])
def test_every_crank_rocker_is_found_from_its_swing_time_ratio_and_transmission_angle(count):
    """The bound on the transmission angle cuts the families at the linkage that the task is of.

    The least distance to a candidate is 1e-9 of a range, left out at its ends; near the best linkage of a family the
    angle is flat, so that its 16 digits leave 8 of the lengths, scaled by the link ratio.
    """
    frame = random_crank_rockers(count, seed=3)
    assert len(frame) == count
    for _, row in frame.iterrows():
        angle = min(row["transmission_angle_min"], 180 - row["transmission_angle_max"])
        text = f"""task = "dead-positions"
            [target]
            swing_angle = {float(row["swing_angle"])!r}
            time_ratio = {float(row["time_ratio"])!r}
            ground = {float(row["ground"])!r}
            [bounds]
            transmission_angle_min = {float(angle)!r}
            """
        found = parse_task(text, "task.toml").find().parameters
        off = [np.abs(found[name] / row[name] - 1) for name in ("crank", "coupler", "rocker")]
        assert np.max(off, axis=0).min() < 1e-6, row


#: Entries of the target, or what follows it, that a task refuses, and the reason.
REFUSED = {
    "dwell": [
        ("stroke = 30", "target.dwell_angle: is missing"),
        ("dwell_angle = 310\nstroke = 30", "dwell_angle: must be at least 1 and below 300 deg"),
        ("dwell_angle = 0\nstroke = 30", "dwell_angle: must be at least 1 and below 300 deg, got 0"),
        ("dwell_angle = 90\nstroke = -1", "stroke: must be above 0 mm"),
    ],
    "function": [
        ("", "formula: give one of formula"),
        ('formula = "x"\ntable = [[1, 2]]', "table: give one of formula"),
        ("formula = 3\nfrom = 1\nto = 2", "formula: must be a string"),
        ('formula = "x"\nfrom = 1\nto = 1', "to: must differ from from"),
        ("table = [[1, 2], [3]]", "table: must be a list of pairs"),
        ("table = [[1, 2], [2, 3]]", "table: has 2 pairs"),
    ],
    "motion": [
        ("poses = [[0, 0, 0], [1, 1, 1]]", "2 poses; give 3 or more"),
        ("poses = [[0, 0, 0], [1, 1], [2, 2, 'x']]", r"pose 2 must be \[x, y, angle\]"),
        ("poses = [[0, 0, 0], [1, 1, 1], [1, 1, 1]]", "poses 2 and 3 are alike"),
        ("poses = [[0, 0, 5], [1, 1, 5], [2, 1, 5]]", "all poses have the same angle"),
        ("poses = [[1, 1, 5], [1, 1, 6], [1, 1, 7]]", "all poses have the same place"),
    ],
    "slider-path": [
        ("points = [[0, 0], [1, 1], [2, 0]]", "target.points: a path for a slider-crank has from 5 to 2000 points"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [3, 1]]", "points 4 and 5 are equal"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [4, 4]]\n[bounds]\npressure_angle_max = 95", "below 89"),
        ("points = [[0, 0], [1, 1], [2, 0], [3, 1], [4, 4]]\n[bounds]\ncrank_pivot = 3", "crank_pivot: must be"),
    ],
}


@pytest.mark.parametrize(
    ("kind", "entries", "message"), [(kind, *row) for kind, rows in REFUSED.items() for row in rows]
)
def test_targets_that_are_refused(kind, entries, message):
    more = "input_angle = 60\noutput_angle = 60\n" if kind == "function" else ""
    with pytest.raises(ConfigError, match=message):
        parse_task(f'task = "{kind}"\n[target]\n{entries}\n{more}', "task.toml")
