"""What is valid but may not be meant: one line of a command, a warning of Python, an attribute of a study or a task."""

import warnings

import numpy as np
import pytest
from command_line import run

import explore
from explore import DoubtfulInputWarning
from explore.mechanisms.registry import MECHANISMS
from explore.model.targets import PathTarget
from explore.studies.config.study_file import load_study, starter
from explore.studies.request.path_order import remark_on_order
from explore.synthesis.tasks.registry import TASK_TYPES
from explore.synthesis.tasks.task_files import load_task, parse_task, task_starter

LENGTHS = {"crank": 10, "coupler": 60, "rocker": 50, "ground": 55}
#: Points of an ellipse in order, and their numbers in an order of a shuffled deck.
ELLIPSE = [(40 * np.cos(t), 20 * np.sin(t)) for t in 2 * np.pi * np.arange(12) / 12]
SHUFFLED = np.random.default_rng(1).permutation(12)


def curve(rng, n, *, is_closed):
    """Points of a random coupler curve in order, at even or at random crank angles of a turn or a part of it."""
    while True:
        crank, coupler, rocker, ground = lengths = rng.uniform(0.2, 3.0, 4)
        if min(crank, ground) > min(lengths) or 2 * (min(lengths) + max(lengths)) >= sum(lengths):
            continue
        span = 2 * np.pi if is_closed else rng.uniform(1.5, 5.5)
        shares = np.arange(n) / (n if is_closed else n - 1) if rng.random() < 0.5 else np.sort(rng.uniform(0, 1, n))
        pins = crank * np.exp(1j * (rng.uniform(0, 2 * np.pi) + span * shares))
        to_pivot = ground - pins
        cosines = (coupler**2 + abs(to_pivot) ** 2 - rocker**2) / (2 * coupler * abs(to_pivot))
        turned = np.angle(to_pivot) + np.arccos(np.clip(cosines, -1, 1))
        return pins + rng.uniform(0, 4) * np.exp(1j * (turned + rng.uniform(0, 2 * np.pi)))


def remarks(points, *, is_closed):
    places = tuple((float(point.real), float(point.imag)) for point in points)
    return remark_on_order(PathTarget("M", places, is_closed), ("target", "points"))


@pytest.mark.parametrize("is_closed", [True, False])
@pytest.mark.parametrize("n", [8, 12, 25])
def test_orders_of_coupler_curves(n, is_closed):
    """Curves of any shape, also with loops, are left alone; the same in any other order are not."""
    rng = np.random.default_rng(n)
    curves = [curve(rng, n, is_closed=is_closed) for _ in range(150)]
    assert sum(bool(remarks(points, is_closed=is_closed)) for points in curves) <= 2  # 0.25 % of 8 points, seldom of 12
    # a few shuffles are as short as the curve itself, 5 % of those of 8 points
    assert sum(bool(remarks(rng.permutation(points), is_closed=is_closed)) for points in curves) >= 135


def test_the_order_offered_is_that_of_the_curve():
    """Up to where it begins and its sense, also of an open path."""
    places = np.array([complex(*place) for place in ELLIPSE])
    for is_closed, points in ((True, places[SHUFFLED]), (False, places[:8][np.argsort(SHUFFLED[:8])])):
        ((key, text),) = remarks(points, is_closed=is_closed)
        assert key == ("target", "points")
        numbers = [int(word) - 1 for word in text.split(" in the order ")[1].split(", in which")[0].split(", ")]
        # the order of the places along the ellipse: each is beside the next
        steps = np.abs(np.diff(points[numbers]))
        assert sorted(numbers) == list(range(len(points)))
        assert steps.max() <= np.abs(np.diff(places)).max() + 1e-12


def test_a_path_is_not_judged_by_its_corners_or_its_angles():
    """A narrow strip is drawn along its sides, though across it the way is shorter; crank angles say the order."""
    there, back = np.linspace(0, 30, 6), np.linspace(30, 0, 6) + 1j
    assert remarks(np.concatenate([there, back]), is_closed=False) == []
    places = tuple(ELLIPSE[k] for k in SHUFFLED)
    timed = PathTarget("M", places, closed=True, crank_angles=tuple(float(k) for k in range(12)))
    assert remark_on_order(timed, ("target",)) == []
    assert remark_on_order(PathTarget("M", places, closed=True), ("target",)) != []


def shuffled(entries):
    return [list(map(float, entries[k])) for k in SHUFFLED]


def test_unordered_points_of_studies_and_tasks(tmp_path):
    path = {"kind": "path", "points": shuffled(ELLIPSE), "closed": True}
    parameters = {**LENGTHS, "crank": [10, 20]}
    points = {"M": {"along": "5 mm", "across": "5 mm"}}
    with pytest.warns(
        DoubtfulInputWarning, match=r"^target\.points: the order of the points looks wrong: in it the way"
    ):
        study = explore.Study(mechanism="crank-rocker", parameters=parameters, points=points, target=path)
    (remark,) = study.remarks
    (tmp_path / "study.toml").write_text(study.to_toml())
    with pytest.warns(DoubtfulInputWarning, match=r"study.toml:\d+: target.points: the order of the points"):
        assert load_study(tmp_path / "study.toml").remarks[0].endswith(remark)
    poses = [[*place, 10.0 * k] for k, place in enumerate(shuffled(ELLIPSE))]
    for order, n in (("given", 1), ("any", 0)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            target = {"kind": "poses", "poses": poses, "order": order}
            explore.Study(mechanism="crank-rocker", parameters=parameters, points=points, target=target)
        assert [str(each.message).startswith("target.poses: the order") for each in caught] == [True] * n
    for task, section in (
        ("path", f"points = {path['points']}\nclosed = true"),
        ("slider-path", f"points = {path['points']}\nclosed = true"),
        ("motion", f"poses = {poses}"),
    ):
        found = parse_task(f'task = "{task}"\n[target]\n{section}\n', "task.toml")
        assert [remark.startswith("task.toml:3: target.po") for remark in found.remarks] == [True]
    rows = "\n".join(f"{x},{y}" for x, y in path["points"])
    (tmp_path / "path.csv").write_text(f"x,y\n{rows}\n")
    (tmp_path / "task.toml").write_text('task = "path"\n[target]\nfile = "path.csv"\nclosed = true\n')
    with pytest.warns(DoubtfulInputWarning, match=r"task.toml:3: target.file: the order of the points looks wrong"):
        load_task(tmp_path / "task.toml")
    printed = run("synthesize", "task.toml", "--dry-run", cwd=tmp_path).stderr
    assert printed.count("warning: task.toml:3: target.file: the order of the points looks wrong") == 1
    assert printed.count("warning: ") == 1


SINE = """task = "function"
[target]
formula = "{}"
from = 0
to = {}
input_angle = 90
output_angle = 90
"""


@pytest.mark.parametrize(
    ("formula", "to", "narrow"),
    [
        ("sin(x)", "1.5707963", ["sin takes degrees, and its argument has a range of 1.571 deg only"]),
        ("x + 2 * cos(-x / 3 + 5) ** 2", "20", ["cos takes degrees, and its argument has a range of 6.667 deg only"]),
        ("hypot(tan(x), sin(max(x, 2 * x)))", "4", ["sin takes degrees", "tan takes degrees"]),
        ("sin(x)", "90", []),
        ("sin(x * 180 / pi)", "1.5707963", []),
        ("sin(30) * x + log(x + 1)", "1", []),
        ("atan2(x, 1)", "1", []),
    ],
)
def test_sines_of_a_few_degrees(tmp_path, formula, to, narrow):
    (tmp_path / "task.toml").write_text(SINE.format(formula, to))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        task = load_task(tmp_path / "task.toml")
    assert len(task.remarks) == len(caught) == len(narrow)
    for words, remark, warning in zip(narrow, task.remarks, caught, strict=True):
        assert remark == str(warning.message)
        assert remark.startswith(f"{tmp_path}/task.toml:3: target.formula: {words}")
        assert warning.category is DoubtfulInputWarning
        assert warning.filename == __file__


def test_numbers_without_a_unit_beside_other_units(tmp_path):
    """Once for a study or a task, with the first number and how many there are."""
    text = (
        'mechanism = "crank-rocker"\n[parameters]\ncrank = { start = "1 in", stop = 40, num = 4 }\ncoupler = "10 in"\n'
        'rocker = [5, 6]\nground = "6 in"\nspeed = 40\n[units]\nlength = "in"\n'
    )
    (tmp_path / "study.toml").write_text(text)
    said = (
        'study.toml:3: parameters.crank: 40 is 40 mm, although [units] shows in; write "40 in" or "40 mm"; 2 more such '
        "numbers follow"
    )
    with pytest.warns(DoubtfulInputWarning) as caught:
        study = load_study(tmp_path / "study.toml")
    assert [str(each.message).removeprefix(f"{tmp_path}/") for each in caught] == [said]
    printed = run("sweep", "study.toml", "--dry-run", cwd=tmp_path)
    assert printed.stderr.splitlines()[0] == f"warning: {said}"
    assert printed.stderr.count("warning: ") == 1
    results = explore.sweep(study, tmp_path / "study.h5", workers=1)  # reading the results says nothing more
    explore.rank(results)
    for sections in (
        'constraints = { transmission_angle_min = { min = 30 } }\nunits = { angle = "rad" }',
        'tolerances = { crank = 0.1 }\nunits = { length = "cm" }',
    ):
        (tmp_path / "study.toml").write_text(
            f'mechanism = "crank-rocker"\n{sections}\n[parameters]\n'
            'crank = ["1 cm", "2 cm"]\ncoupler = "6 cm"\nrocker = "5 cm"\nground = "5.5 cm"\n'
        )
        with pytest.warns(DoubtfulInputWarning, match=r"although \[units\] shows (cm|rad); write") as caught:
            load_study(tmp_path / "study.toml")
        assert len(caught) == 1
    swing = 'task = "swing"\n[target]\nswing_angle = "40 deg"\ntime_ratio = 1.25\n{}[units]\nlength = "in"\n'
    assert parse_task(swing.format(""), "task.toml").remarks == ()
    assert parse_task(swing.format("ground = 4\n"), "task.toml").remarks == (
        'task.toml:5: target.ground: 4 is 4 mm, although [units] shows in; write "4 in" or "4 mm"',
    )


@pytest.mark.parametrize("name", [*MECHANISMS, *TASK_TYPES])
def test_starters_have_no_remarks(name):
    if name in TASK_TYPES:
        assert parse_task(task_starter(name), "task.toml").remarks == ()
    else:
        assert (
            explore.studies.config.study_file.parse_study(starter(MECHANISMS[name]), "study.toml", None).remarks == ()
        )


def test_a_constraint_at_the_value_that_a_length_is_solved_for(tmp_path):
    """Rounding would decide 270 of 774 such designs; one beside it, or of another metric, is left alone."""
    file = tmp_path / "study.toml"
    for limit, count in (("{ min = '40 deg' }", 1), ("{ max = 40 }", 1), ("{ min = 39.9 }", 0)):
        file.write_text(
            "mechanism = 'crank-rocker'\n[parameters]\ncrank = { solve = 'swing_angle', value = '40 deg' }\n"
            "coupler = 200\nrocker = 150\nground = 180\n[evaluate]\nmetrics = ['cv']\n"
            f"[constraints]\nswing_angle = {limit}\ntransmission_angle_min = {{ min = 40 }}\n"
        )
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            load_study(file)
        texts = [str(warning.message) for warning in caught]
        assert sum("rounding decides which designs meet it" in text for text in texts) == count, texts
