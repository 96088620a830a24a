"""Tasks of paths: points of a file, bounds, exact nine points, linkages found again, and mistakes in one line."""

import base64
import dataclasses
import re

import numpy as np
import pytest
from command_line import run
from studies import synthesize_text
from synthesis_cases import PROBLEMS

import explore
from explore.base.errors import ConfigError
from explore.synthesis.cognates import cognate_angles, find_cognates
from explore.synthesis.linkages import FourBar, driven_by_rocker, is_alike
from explore.synthesis.paths.search import PathSolution
from explore.synthesis.tasks.path_search import _distinct, find_timed_errors
from explore.synthesis.tasks.task_files import load_task, parse_task, task_starter

LINKAGE = FourBar(1 + 2j, 1 + 2j + 40 * np.exp(0.3j), 10.0, 35.0, 25.0, 0.6 + 0.7j, 1)


def task_text(points, target="", bounds="", search=""):
    pairs = [[float(point.real), float(point.imag)] for point in points]
    return f'task = "path"\n[target]\npoints = {pairs}\n{target}\n[bounds]\n{bounds}\n[search]\n{search}\n'


def find(text, folder=None):
    return parse_task(text, "task.toml", folder).find()


def problems_of(text, folder=None):
    with pytest.raises(ConfigError) as caught:
        parse_task(text, "task.toml", folder)
    return caught.value.problems


def linkage_at(parameters, row):
    """The four-bar of a row of candidates."""
    get = {name: float(values[row]) for name, values in parameters.items()}
    pivot = complex(get["crank_pivot_x"], get["crank_pivot_y"])
    arm = complex(get["M_along"], get["M_across"])
    return FourBar(
        pivot, pivot + get["ground"] * np.exp(1j * np.radians(get["ground_angle"])), get["crank"], get["coupler"],
        get["rocker"], arm / get["coupler"], int(get["branch"]),
    )  # fmt: skip


def distance_of(one, other):
    """Largest difference of places and lengths, over the longest link."""
    pairs = [(one.crank_pivot, other.crank_pivot), (one.rocker_pivot, other.rocker_pivot), (one.point, other.point)]
    pairs += zip(one.lengths, other.lengths, strict=True)
    return max(abs(a - b) for a, b in pairs) / max(one.lengths)


def is_found(linkage, candidates, tolerance):
    """Whether the linkage is a candidate, as found or as a cognate; a double crank may be driven by its other crank."""
    rows = [linkage_at(candidates.parameters, row) for row in range(candidates.count)]
    return any(distance_of(each, row) < tolerance for row in rows for each in (linkage, driven_by_rocker(linkage)))


POINTS = LINKAGE.points(np.linspace(0, 2 * np.pi, 20, endpoint=False))


def test_a_linkage_is_found_with_its_cognates_which_draw_the_same_path(tmp_path):
    """That the error of a cognate is that of its linkage is a second road to both: they share no length."""
    text = task_text(POINTS, "closed = true")
    candidates = find(text)
    assert is_found(LINKAGE, candidates, 1e-6)
    results = synthesize_text(tmp_path, text)
    frame = results.to_pandas()
    first = frame[frame["solution"] == 1].set_index("cognate")
    assert first["path_error_rms"][0] < 1e-5
    assert first["path_error_rms"][2] == pytest.approx(first["path_error_rms"][0], abs=1e-6)
    assert frame["feasible"][0]
    # the first cognate is driven by a link that only rocks, so that its crank cannot pass all points
    assert (frame["passage"][frame["cognate"] == 1] != 0).any()
    assert results.constraints.keys() >= {"transmission_angle_worst", "longest_link"}


def test_pivots_stay_in_their_boxes():
    text = task_text(POINTS, "closed = true", "crank_pivot = { x = [5, 8], y = 3 }\nrocker_pivot = { x = [0, 100] }")
    candidates = find(text)
    as_found = candidates.values["cognate"] == 0
    x, y = (candidates.parameters[f"crank_pivot_{axis}"][as_found] for axis in "xy")
    assert (x >= 5 - 1e-9).all()
    assert (x <= 8 + 1e-9).all()
    np.testing.assert_allclose(y, 3, rtol=1e-12)


#: A closed path, 100 by 40 mm, that no four-bar draws.
TURN = np.arange(40) * 2 * np.pi / 40
OVAL = 50 * np.cos(TURN) + 10 * np.cos(2 * TURN) + 20j * np.sin(TURN)


@pytest.mark.parametrize(
    ("bounds", "boxes", "best"),
    [
        # 1.368 is what 40 starts of a least-squares search with a price for each bound find.
        ("crank_pivot = { x = [-20, 20], y = [60, 90] }\nrocker_pivot = { x = [60, 120], y = [-50, 50] }",
         ((-20 + 60j, 20 + 90j), (60 - 50j, 120 + 50j)), 1.368),
        ("crank_pivot = { x = 0, y = -60 }\nrocker_pivot = { x = 120, y = -60 }\nlink_ratio_max = 4",
         ((-60j, -60j), (120 - 60j, 120 - 60j)), 4.77),
        ("rocker_pivot = { x = [0, 0], y = [-200, -100] }",
         ((complex(-np.inf, -np.inf), complex(np.inf, np.inf)), (-200j, -100j)), 1.0),
    ],
)  # fmt: skip
def test_all_bounds_hold_where_the_path_is_met_best(bounds, boxes, best):
    text = task_text(OVAL, "closed = true", f"transmission_angle_min = 20\nsize_ratio_max = 3\n{bounds}", "count = 4")
    candidates = find(text)
    turn, errors = np.linspace(0, 2 * np.pi, 3600, endpoint=False), []
    for row in np.flatnonzero(candidates.values["cognate"] == 0):
        linkage = linkage_at(candidates.parameters, row)
        for pivot, (low, high) in zip((linkage.crank_pivot, linkage.rocker_pivot), boxes, strict=True):
            assert low.real - 1e-6 <= pivot.real <= high.real + 1e-6
            assert low.imag - 1e-6 <= pivot.imag <= high.imag + 1e-6
        angles = linkage.transmission_angles(turn)
        assert np.minimum(angles, np.pi - angles).min() >= np.radians(20) - 1e-9
        lengths = [*linkage.lengths, abs(linkage.point) * linkage.coupler]
        assert max(lengths) <= 300 * (1 + 1e-9)
        assert "link_ratio_max" not in bounds or max(linkage.lengths) <= 4 * min(linkage.lengths) * (1 + 1e-9)
        distances = np.abs(linkage.points(turn) - OVAL[:, None]).min(axis=1)
        errors.append(np.sqrt(np.mean(distances**2)))
    assert min(errors) <= best


def test_candidates_outside_a_box_are_rows_that_are_not_feasible(tmp_path):
    text = task_text(POINTS, "closed = true", "rocker_pivot = { x = [30, 50], y = [10, 20] }")
    frame = synthesize_text(tmp_path, text).to_pandas()
    angle = np.radians(frame["ground_angle"])
    x = frame["crank_pivot_x"] + frame["ground"] * np.cos(angle)
    y = frame["crank_pivot_y"] + frame["ground"] * np.sin(angle)
    outside = (x < 30 - 1e-3) | (x > 50 + 1e-3) | (y < 10 - 1e-3) | (y > 20 + 1e-3)
    assert outside.any()
    assert not frame["feasible"][outside].any()
    assert (frame["rocker_pivot_outside_margin"][outside] < 0).all()


def test_a_linkage_is_one_solution_though_its_cognate_was_found_too():
    """Of the starter's optima two are cognates of each other: their errors and one pivot are equal."""
    candidates = parse_task(task_starter("path"), "task.toml").find()
    rows = [linkage_at(candidates.parameters, row) for row in range(candidates.count)]
    solutions = candidates.values["solution"]
    assert len(set(solutions)) >= 4
    for one in range(len(rows)):
        for other in range(one):
            assert not is_alike(rows[one], rows[other], 1e-3), (solutions[one], solutions[other])


def test_solutions_of_one_family_are_one():
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    found = PathSolution(LINKAGE, angles, 1e-9)
    pivot = find_cognates(LINKAGE)[1]
    turned = cognate_angles(LINKAGE, angles)[1]
    cognate = PathSolution(pivot, turned, 2e-9)
    moved = PathSolution(dataclasses.replace(LINKAGE, crank=10.5), angles, 3e-9)
    assert _distinct([cognate, moved, found]) == [found, moved]


def test_an_open_path_in_its_order():
    points = LINKAGE.points(np.linspace(0.5, 3.0, 15))
    candidates = find(task_text(points, bounds="crank_span_min = 120"))
    assert is_found(LINKAGE, candidates, 1e-5)


def test_points_with_crank_angles():
    angles = np.radians([0, 40, 85, 130, 180, 220, 300])
    points = LINKAGE.points(angles)
    text = f"crank_angles = {np.degrees(angles).tolist()}\nangles_from = 'free'"
    candidates = find(task_text(points, text))
    assert is_found(LINKAGE, candidates, 1e-5)
    errors, largest = candidates.values["timed_error_rms"], candidates.values["timed_error_max"]
    assert errors[0] < 1e-4
    # the crank of the second cognate turns as that of its linkage does
    assert errors[2] == pytest.approx(errors[0], abs=1e-6)
    assert (errors <= largest + 1e-12)[np.isfinite(errors)].all()


@pytest.mark.parametrize("angles_from", ["free", "frame"])
def test_errors_at_crank_angles_against_distances_by_hand(angles_from):
    """A linkage moved by 3 mm misses every point by 3 mm at its angle, however the angles count."""
    angles = np.radians([0, 40, 85, 130, 180, 220, 300])
    points = LINKAGE.points(angles + (0.3 if angles_from == "frame" else 1.7))
    moved = FourBar(LINKAGE.crank_pivot + 3, LINKAGE.rocker_pivot + 3, 10.0, 35.0, 25.0, LINKAGE.point, 1)
    is_free = angles_from == "free"
    exact = find_timed_errors(LINKAGE, points, angles, np.ones(7), is_shift_free=is_free)
    assert exact == pytest.approx((0, 0), abs=1e-7)
    rms, largest = find_timed_errors(moved, points, angles, np.ones(7), is_shift_free=is_free)
    assert rms <= 3 + 1e-12 if is_free else rms == pytest.approx(3, rel=1e-14)
    assert largest >= rms - 1e-12


def test_all_linkages_through_nine_points():
    angles = np.array([0.1, 0.9, 1.4, 2.2, 3.0, 3.7, 4.4, 5.1, 5.9])
    candidates = find(task_text(LINKAGE.points(angles), search="exact = true"))
    assert candidates.tried[0].startswith("Of 1,442 paths ")
    assert candidates.tried[0].endswith("So the search is complete.")
    assert is_found(LINKAGE, candidates, 1e-8)
    passing = [row for row in range(candidates.count) if candidates.values["passage"][row] == 0]
    assert any(distance_of(LINKAGE, linkage_at(candidates.parameters, row)) < 1e-8 for row in passing)
    assert candidates.values["proved"].all()


def planted(count, seed):
    """Crank-rockers with a transmission angle of 25 deg or more, and a coupler point not far off."""
    rng = np.random.default_rng(seed)
    while count:
        crank, coupler, rocker, ground = np.exp(rng.uniform(np.log(0.3), np.log(3.0), 4)) * 20
        linkage = FourBar(
            complex(*rng.uniform(-50, 50, 2)), 0j, crank, coupler, rocker, complex(*rng.uniform(-1.2, 1.8, 2)),
            int(rng.choice([1, -1])),
        )  # fmt: skip
        other = linkage.crank_pivot + ground * np.exp(1j * rng.uniform(0, 2 * np.pi))
        linkage = FourBar(linkage.crank_pivot, other, crank, coupler, rocker, linkage.point, linkage.branch)
        turn = np.linspace(0, 2 * np.pi, 361)
        if not linkage.is_crank_turning or np.sin(linkage.transmission_angles(turn)).min() < np.sin(np.radians(25)):
            continue
        path = linkage.points(turn)
        if max(linkage.lengths) < 8 * max(np.ptp(path.real), np.ptp(path.imag)):
            yield linkage
            count -= 1


@pytest.mark.parametrize(("count", "least"), [(3, 3), pytest.param(1000, 980, marks=pytest.mark.slow)])
def test_planted_linkages_are_found_again(count, least):
    """The crank angles of the points are uneven. A least-squares fit of 9 numbers to exact points has its last digits
    where the sum of squares is flat, 1e-4 of the longest link; 2 % of searches end in other local optima.
    """
    rng = np.random.default_rng(7)
    found = 0
    for linkage in planted(count, seed=8):
        angles = np.cumsum(rng.uniform(0.5, 1.5, 25))
        points = linkage.points(angles * (2 * np.pi / (angles[-1] + 1.0)))
        found += is_found(linkage, find(task_text(points, "closed = true", search="count = 8")), 1e-4)
    assert found >= least


def test_timed_candidates_are_ranked_by_their_error_at_the_angles(tmp_path):
    angles = np.radians([0, 40, 85, 130, 180, 220, 300])
    text = f"crank_angles = {np.degrees(angles).tolist()}"
    (tmp_path / "task.toml").write_text(task_text(LINKAGE.points(angles), text, search="count = 4"), encoding="utf-8")
    output = run("synthesize", "task.toml", cwd=tmp_path)
    assert "timed_error_rms" in output.stdout
    assert "those that pass first, then by timed_error_rms" in output.stdout
    run("rank", "--metric", "timed_error_rms", "--metric", "timed_error_max", cwd=tmp_path)
    results = explore.open_results(tmp_path / "results" / "task.h5")
    assert results.objectives == ("timed_error_rms:min", "transmission_angle_worst:max", "footprint:min")
    assert (
        "only the solver of the task computes timed_error_rms"
        in run("refine", "results/task.h5", cwd=tmp_path, code=2).stderr
    )


def test_a_drawn_path_from_a_table_to_a_drawing(tmp_path):
    """As a user would: points in a CSV file, with a heading, and the chosen linkage as DXF."""
    rows = "\n".join(f"{x:.2f},{y:.2f}" for x, y in PROBLEMS["yu1"]["points"])
    (tmp_path / "path.csv").write_text(f"x,y\n{rows}\n", encoding="utf-8")
    (tmp_path / "task.toml").write_text('task = "path"\n[target]\nfile = "path.csv"\nclosed = true\n', encoding="utf-8")
    output = run("synthesize", "task.toml", cwd=tmp_path)
    assert "those that pass first, then by path_error_rms" in output.stdout
    assert "passes: the crank takes the coupler point through all points in their order" in output.stdout
    best = explore.rank(tmp_path / "results" / "task.h5").iloc[0]
    # the best sum of squares known for these 20 points with 20 deg is 0.85426
    assert best["path_error_rms"] ** 2 * 20 == pytest.approx(0.85426, rel=1e-3)
    run("export", "results/task.h5", "--design", str(best.name), "-o", "best.dxf", cwd=tmp_path)
    run("report", "results/task.h5", "-o", "report.html", cwd=tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    (svg,) = re.findall(f'<img alt="Cognates of design {best.name}" src="data:image/svg\\+xml;base64,([^"]+)">', page)
    assert b"<svg" in base64.b64decode(svg)
    run("refine", "results/task.h5", "--evaluations", "512", cwd=tmp_path)
    refined = explore.rank(tmp_path / "results" / "task-refined.h5")
    assert refined["path_error_rms"].min() <= best["path_error_rms"]


def test_points_of_a_file_that_are_no_path_are_one_line(tmp_path):
    (tmp_path / "path.csv").write_text("0,0\n0,0\n1,1\n", encoding="utf-8")
    (line,) = problems_of('task = "path"\n[target]\nfile = "path.csv"\n', tmp_path)
    assert line == "task.toml:3: target.file: points 1 and 2 are equal; remove one"


def test_a_misspelled_key_is_known(tmp_path):
    _, line = problems_of('task = "path"\n[target]\npionts = [[0, 0], [1, 1], [2, 0]]\n', tmp_path)
    assert line == "task.toml:3: target.pionts: unknown key; did you mean 'points'?"


SQUARE = [0, 10, 10 + 10j, 10j]


@pytest.mark.parametrize(
    ("text", "key", "problem"),
    [
        (task_text([0, 1, 1, 2j]), "target.points", "points 2 and 3 are equal; remove one"),
        (task_text([0, 1, 1j, 0], "closed = true"), "target.points",
         "points 1 and 4 are equal; leave out the last: a closed path returns to the first by itself"),
        (task_text(SQUARE, "crank_angles = [0, 1]"), "target.crank_angles", "2 for 4 points; give each point one"),
        (task_text(SQUARE, "weights = [1, 1, 0, 1]"), "target.weights", "must be above 0, got 0"),
        (task_text(SQUARE, search="exact = true"), "search.exact",
         "needs nine points, but the path has 4; leave it out"),
        (task_text(SQUARE, bounds="crank_pivot = { x = [5, 1] }"), "bounds.crank_pivot.x",
         "must be [least, largest], got [5, 1]"),
        (task_text(SQUARE, bounds="crank_pivot = 3"), "bounds.crank_pivot",
         "must be a table such as { x = [-50, 50], y = 0 }, got 3"),
        (task_text(SQUARE, bounds="rocker_pivot = { z = 3 }"), "bounds.rocker_pivot.z",
         "unknown key; a pivot has x and y, such as { x = [-50, 50], y = 0 }"),
        (task_text(SQUARE, "closed = true", "crank_span_min = 90"), "bounds.crank_span_min",
         "is for open paths without crank angles; remove it"),
        (task_text(SQUARE, bounds="crank_span_min = 360"), "bounds.crank_span_min",
         "must be at least 0 and below 360 deg, got 360"),
    ],
)  # fmt: skip
def test_a_wrong_path_is_one_line(text, key, problem):
    (line,) = problems_of(text)
    assert line.split(": ", 2)[1:] == [key, problem]


def test_a_million_points_in_the_task_itself_are_one_line(tmp_path):
    (tmp_path / "task.toml").write_text(f'task = "path"\n[target]\npoints = [{"[0.5, 1.5]," * 1_000_000}]\n')
    with pytest.raises(ConfigError) as caught:
        load_task(tmp_path / "task.toml")
    (line,) = caught.value.problems
    assert line.endswith(
        "has 11,000,035 bytes, but a file has at most 2,097,152; thin the points: a path has at most 500"
    )


def test_where_no_linkage_meets_the_bounds_the_nearest_are_rows_that_are_not_feasible(tmp_path):
    """Links and arms of a twentieth of the path's size do not reach along it."""
    text = task_text(POINTS, "closed = true", "size_ratio_max = 0.05") + "[constraints]\npath_error_rms = { max = 1 }\n"
    (tmp_path / "task.toml").write_text(text, encoding="utf-8")
    output = run("synthesize", "task.toml", cwd=tmp_path)
    assert "none of the candidates is within the bounds; these come nearest" in output.stderr
    assert "path_error_rms" in output.stdout
    results = explore.open_results(tmp_path / "results" / "task.h5")
    assert not results.to_pandas()["feasible"].any()
