"""The public problems of path synthesis: published linkages and those of `explore`, scored by one measure, and times.

Run with ``python benchmarks/paths.py [PROBLEM]...``. The measure is the sum of squared distances of the given points to
the curve of one branch over a turn of the crank, for nondecreasing crank angles in either sense. It is computed here by
dynamic programming over samples, apart from the search, which only says where its linkages are; timed points are
measured at their angles. Published objectives differ in part: they add penalties, or fix the angles.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

from explore.synthesis.linkages import FourBar
from explore.synthesis.paths.search import PathTask, find_paths

PROBLEMS = json.loads((Path(__file__).parents[1] / "tests/reference/path_benchmarks.json").read_text(encoding="utf-8"))
TRANSMISSION_ANGLE, LINK_RATIO = np.radians(20.0), 10.0
#: Samples of a turn, and samples of each refinement of the angles and how many there are.
N_SAMPLES, N_FINE, N_REFINEMENTS = 720, 41, 10


def task_of(problem):
    """The `PathTask` of a problem."""
    angles, ratio = problem.get("crank_angles_rad"), problem.get("link_ratio_max", LINK_RATIO)
    return PathTask(
        np.array([complex(*pair) for pair in problem["points"]]),
        is_closed=problem.get("is_closed", True),
        crank_angles=None if angles is None else np.array(angles),
        angles_from=problem.get("angles_from", "free"),
        span_min=problem.get("span_min_rad", 0.0),
        transmission_angle_min=TRANSMISSION_ANGLE,
        link_ratio_max=ratio,
        held={0: 0.0, 1: 0.0, 2: 0.0} if problem.get("is_frame_given") else {},
    )


def published_linkages(problem):
    """Both branches of the published linkage, which the sources do not tell apart; none without one."""
    if (published := problem.get("published")) is None:
        return []
    pivot = complex(*published["crank_pivot"])
    other = pivot + published["ground"] * np.exp(1j * published["ground_angle_rad"])
    if "coupler_point" in published:
        point = complex(*published["coupler_point"])
    else:
        point = published["coupler_point_distance"] * np.exp(1j * published["coupler_point_angle_rad"])
    lengths = [published[name] for name in ("crank", "coupler", "rocker")]
    return [FourBar(pivot, complex(other), *lengths, point / lengths[1], branch) for branch in (1, -1)]


def score(task, linkage):
    """The sum of squares of a linkage; infinite where its crank does not turn."""
    if not linkage.is_crank_turning:
        return np.inf
    if task.crank_angles is None:
        return min(ordered_score(linkage, task.points), ordered_score(linkage, task.points[::-1]))
    frame = np.angle(linkage.rocker_pivot - linkage.crank_pivot)
    if task.angles_from == "frame":
        return timed_score(linkage, task, frame)
    shifts, step = np.arange(0.0, 2.0 * np.pi, 0.01), 0.01
    for _ in range(N_REFINEMENTS):
        scores = [timed_score(linkage, task, shift) for shift in shifts]
        step *= 0.1
        shifts = shifts[np.argmin(scores)] + step * np.arange(-15, 16)
    return min(scores)


def timed_score(linkage, task, shift):
    """The sum of squares with the crank at the given angles from a direction."""
    return float(np.sum(np.abs(linkage.points(task.crank_angles + shift) - task.points) ** 2))


def ordered_score(linkage, points):
    """The least sum of squares over nondecreasing angles within a turn."""
    samples = np.arange(N_SAMPLES) * (2.0 * np.pi / N_SAMPLES)
    squares = np.abs(linkage.points(samples) - points[:, None]) ** 2
    # Row s, column j: the least sum of the points so far that start at sample s and have turned by at most j samples.
    turned = (np.arange(N_SAMPLES)[:, None] + np.arange(N_SAMPLES + 1)) % N_SAMPLES
    least = np.full(turned.shape, np.inf)
    least[:] = squares[0][np.arange(N_SAMPLES)][:, None]
    for row in squares[1:]:
        least = np.minimum.accumulate(least + row[turned], axis=1)
    start = int(np.argmin(least[:, -1]))
    grids = [samples[start] + np.zeros(1)]
    grids += [samples[start] + np.arange(N_SAMPLES + 1) * (2.0 * np.pi / N_SAMPLES)] * (len(points) - 1)
    best, angles = best_path(linkage, points, grids)
    width = 2.0 * np.pi / N_SAMPLES
    for _ in range(N_REFINEMENTS):
        found, angles = best_path(linkage, points, [a + width * np.linspace(-1.0, 1.0, N_FINE) for a in angles])
        if angles[-1] - angles[0] <= 2.0 * np.pi:
            best = min(best, found)
        width *= 0.2
    return best


def best_path(linkage, points, grids):
    """The least sum of squares over nondecreasing choices from a sorted grid for each point, and the choices."""
    least, chosen = [np.abs(linkage.points(grids[0]) - points[0]) ** 2], []
    for k in range(1, len(points)):
        before = np.searchsorted(grids[k - 1], grids[k], side="right") - 1
        firsts = np.minimum.accumulate(least[-1])
        squares = np.abs(linkage.points(grids[k]) - points[k]) ** 2
        least.append(squares + np.where(before >= 0, firsts[before], np.inf))
        chosen.append(before)
    place = int(np.argmin(least[-1]))
    angles = [grids[-1][place]]
    for k in range(len(points) - 2, -1, -1):
        place = int(np.argmin(least[k][: chosen[k][place] + 1]))
        angles.append(grids[k][place])
    return float(least[-1].min()), np.array(angles[::-1])


def transmission_angle(linkage):
    """The least of the transmission angle and its supplement over a turn, deg."""
    angles = np.degrees(linkage.transmission_angles(np.linspace(0.0, 2.0 * np.pi, 3601)))
    return float(np.minimum(angles, 180.0 - angles).min())


def described(task, linkage, error):
    """Columns of a linkage: its error, transmission angle and longest link over the size of the path."""
    if linkage is None or not np.isfinite(error):
        return f"{'-':>10} {'-':>5} {'-':>6}"
    return f"{error:10.4e} {transmission_angle(linkage):5.1f} {max(linkage.lengths) / task.size:6.2f}"


def line_deviation():
    """Largest deviation from a line, over its length, of a linkage for 50 of its points over 90 deg of the crank."""
    task = PathTask(np.linspace(0.0, 1.0, 50) + 0j, is_closed=False, span_min=np.pi / 2)
    begin = time.perf_counter()
    solution = find_paths(task)[0]
    seconds = time.perf_counter() - begin
    path = solution.linkage.points(np.linspace(solution.angles[0], solution.angles[-1], 20_001))
    return float(np.abs(path.imag).max()), solution.linkage, task, seconds


def main():
    names = sys.argv[1:] or [name for name in PROBLEMS if "real_classes" not in PROBLEMS[name]]
    begin = time.perf_counter()
    find_paths(PathTask(np.exp(1j * np.arange(9))))
    print(f"compiling or reading the cache, and making the atlas: {time.perf_counter() - begin:.1f} s\n")
    print(f"{'':21}{'published':>26}{'ours':>26}{'best known':>12}{'time':>9}")
    print(f"{'problem':16}{'n':>5} {'SSE':>13} {'mu':>5} {'link':>6} {'SSE':>13} {'mu':>5} {'link':>6}")
    for name in names:
        problem = PROBLEMS[name]
        task = task_of(problem)
        begin = time.perf_counter()
        solutions = find_paths(task)
        seconds = time.perf_counter() - begin
        ours = solutions[0].linkage if solutions else None
        error = np.inf if ours is None else score(task, ours)
        theirs = min(published_linkages(problem), key=lambda each: score(task, each), default=None)
        known = problem.get("best_known_sse_mu20")
        print(
            f"{name:16}{len(task.points):5}    "
            f"{described(task, theirs, np.inf if theirs is None else score(task, theirs))}    "
            f"{described(task, ours, error)} {f'{known:.4e}' if known else '-':>11} {seconds:7.2f} s"
        )
    deviation, linkage, task, seconds = line_deviation()
    angle, longest = transmission_angle(linkage), max(linkage.lengths)
    print(f"\n50 points of a line over 90 deg of the crank: largest deviation {deviation:.2e} of the length,")
    print(f"transmission angle {angle:.1f} deg, longest link {longest:.2f}, {seconds:.2f} s")


if __name__ == "__main__":
    main()
