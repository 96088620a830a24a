"""Groups of four links that no dyad solves: all assemblies, the one that is meant, and where it leads."""

import json
import re
import shutil
import subprocess
import tomllib
from itertools import combinations

import mpmath
import numpy as np
import pytest
from linkage_cases import REFERENCE, columns, find_limits
from numba import njit
from slot_groups import GROUPED
from test_linkage_pairs import samples_of

import explore
from explore import Linkage
from explore.base.errors import ConfigError, RequestError
from explore.figures.reporting.javascript import translate
from explore.mechanisms.linkages.following import TIES_SIZE
from explore.mechanisms.linkages.group_assemblies import find_assembly
from explore.mechanisms.linkages.group_ties import STATE_SIZE
from explore.mechanisms.linkages.metrics import REACH_NAMES
from explore.mechanisms.linkages.motions import _kernel
from explore.studies.config.study_file import linkage_starter

STARTERS = {name: tomllib.loads(linkage_starter(name)) for name in ("stephenson-2", "stephenson-3-far")}
LINKAGES = {name: Linkage(sections) for name, sections in STARTERS.items()}
SETS = REFERENCE["statuses"]["groups_that_are_not_dyads"]["stephenson-2"]
#: Largest of 16,384 steps of the second road, rad, by which an angle changes.
LARGEST_STEP = 0.06


def middle(name):
    """The middles of the ranges of a starter."""
    entries = STARTERS[name]["parameters"]
    return {key: (each["min"] + each["max"]) / 2 for key, each in entries.items() if isinstance(each, dict)}


def random_designs(name, count, rng, share=0.3):
    """Designs up to `share` of the ranges of a starter beyond them."""
    result = {"speed": np.ones(count)}
    for key, entry in STARTERS[name]["parameters"].items():
        if isinstance(entry, dict):
            beyond = share * (entry["max"] - entry["min"])
            result[key] = rng.uniform(entry["min"] - beyond, entry["max"] + beyond, count)
    return result


class Bars:
    """The vectors of the two bars of designs, without the package: from end to end, by three angles."""

    def __init__(self, name, values):
        self._is_second, self._values = name == "stephenson-2", values

    def turned(self, alpha, beta):
        """For each bar, what turns with the first and with the second link."""
        v, u, w = self._values, np.exp(1j * alpha), np.exp(1j * beta)
        if self._is_second:
            return (-70.0 * u, (50 + 20j) * w), (-(60 + 55j) * u, (-5 + 75j) * w)
        return (v["l1"] * u, v["q"] * w), (v["l1"] * u, (55 + 38j) * w)

    def misses(self, theta, alpha, beta):
        """Half the squares less those of the lengths, and their slopes."""
        v, crank = self._values, self._values["r1"] * np.exp(1j * theta)
        known = [v["r4"] - crank] * 2 if self._is_second else [crank - 160.0, crank - 60 - 160j]
        lengths = [v["l1"], v["l2"]] if self._is_second else [v["l2"], v["l3"]]
        rows = []
        for (a, b), c, length in zip(self.turned(alpha, beta), known, lengths, strict=True):
            vector = c + a + b
            rows.append((0.5 * (abs(vector) ** 2 - length**2), (np.conj(a) * vector).imag, (np.conj(b) * vector).imag))
        return rows

    def solve(self, theta, alpha, beta, steps):
        """Angles by Newton's method, the determinant and the last step."""
        for _ in range(steps):
            (e, p, q), (f, r, s) = self.misses(theta, alpha, beta)
            determinant = p * s - q * r
            first, second = (q * f - s * e) / determinant, (r * e - p * f) / determinant
            size = np.abs(first) + np.abs(second)
            share = np.minimum(1.0, 0.5 / np.maximum(size, 1e-9))
            alpha, beta = alpha + share * first, beta + share * second
        return alpha, beta, determinant, size


def assemblies(bars, theta, rng, starts=400):
    """All assemblies at a crank angle that random starts lead to."""
    with np.errstate(all="ignore"):
        alpha, beta, _, size = bars.solve(theta, *rng.uniform(0.0, 2.0 * np.pi, (2, starts)), 60)
    found = []
    for state in zip(alpha[size < 1e-9], beta[size < 1e-9], strict=True):
        if all(max(abs(np.exp(1j * np.subtract(state, other)) - 1.0)) > 1e-5 for other in found):
            found.append(state)
    return found


def follow(bars, theta, state, sense, steps=16384):
    """Steps over a turn before the group is lost, and its state there."""
    before, now = state, state
    sign = np.sign(bars.solve(theta, *state, 1)[2])
    for k in range(1, steps + 1):
        guess = (2.0 * now[0] - before[0], 2.0 * now[1] - before[1])
        *new, determinant, size = bars.solve(theta + sense * 2.0 * np.pi * k / steps, *guess, 4)
        step = abs(new[0] - now[0]) + abs(new[1] - now[1])
        if not size < 1e-8 or np.sign(determinant) != sign or step > LARGEST_STEP:
            return k, now
        before, now = now, tuple(new)
    return steps, now


@pytest.mark.parametrize("entry", SETS["sets"], ids=lambda entry: "-".join(entry["parameters"].values()))
def test_statuses_equal_the_reference(entry):
    """Of Stephenson's second six-bar; folds to the rounding of crank angles."""
    section = tomllib.loads(SETS["table"])["linkage"]
    kernel = Linkage(section | {"sketch": entry["sketch"]}, parameters=_numbers(entry)).mechanism
    closed = kernel.evaluate_closed_form(columns(kernel, {k: np.array([v]) for k, v in _numbers(entry).items()}))
    label = kernel.status_labels[closed.status[0]]
    count, *ends = closed.metrics[-len(REACH_NAMES) :, 0]
    if entry["status"] == "turns":
        assert label in ("ok", "no_strokes")
        assert (count, *ends[:2]) == (1, 0.0, 360.0)
    else:
        assert label == "crank_blocked_at_E"
        (known,) = entry["assembles_from_the_sketch_deg"]
        start, end = float(known["start_deg"]) % 360.0, float(known["end_deg"]) + 360.0
        assert count == 1
        assert max(abs(ends[0] - start), abs(ends[1] - end)) <= 1e-12 * 360.0


def _numbers(entry):
    return {name: float(value) for name, value in entry["parameters"].items()} | {"speed": 1.0}


@njit
def _find(ties, angle, alpha, beta, state):
    return find_assembly(ties, angle, alpha, beta, state)


def tie_rows(name, values):
    """The rows of the ties of a design, from the table without its graph."""
    v = values
    if name == "stephenson-2":
        return [*bar(v["r4"], -v["r1"], -70, 50 + 20j, v["l1"]), *bar(v["r4"], -v["r1"], -60 - 55j, -5 + 75j, v["l2"])]
    one = bar(-160, v["r1"], v["l1"], v["q"], v["l2"])
    return [*one, *bar(-60 - 160j, v["r1"], v["l1"], 55 + 38j, v["l3"])]


def bar(*numbers):
    """The rows of a bar, from the complex parts of its vector and from its length."""
    *parts, length = numbers
    terms = [np.conj(parts[i]) * parts[j] for i, j in combinations(range(4), 2)]
    return [
        0.5 * (sum(abs(part) ** 2 for part in parts) - length**2), *(x for t in terms for x in (t.real, t.imag)),
        sum(map(abs, parts)) * length, *(x for part in map(complex, parts) for x in (part.real, part.imag)), length,
        *map(abs, terms),
    ]  # fmt: skip


@pytest.mark.parametrize("name", STARTERS)
def test_the_nearest_of_all_assemblies_is_taken(name):
    """At random crank angles and from random sketches, of those that 400 starts of Newton's method lead to."""
    rng = np.random.default_rng(2)
    designs, met = random_designs(name, 40, rng), set()
    for k in range(40):
        values = {key: column[k] for key, column in designs.items()}
        ties = np.array(tie_rows(name, values), dtype=float)
        assert len(ties) == TIES_SIZE
        theta, alpha, beta = rng.uniform(-np.pi, np.pi, 3)
        state = np.zeros(STATE_SIZE)
        code, known = _find(ties, theta, alpha, beta, state), assemblies(Bars(name, values), theta, rng)
        assert code == (1 if known else -1)
        met.add(len(known))
        if known:
            nearness = [np.cos(a - alpha) + np.cos(b - beta) for a, b in known]
            best = known[int(np.argmax(nearness))]
            assert max(abs(np.exp(1j * np.subtract(state[1:3], best)) - 1.0)) < 1e-9
    assert met >= {0, 2}


@pytest.mark.parametrize("alpha", [0.0, -0.5 * np.pi, np.pi, 0.25 * np.pi, 3.0 * np.pi / 16.0])
def test_an_assembly_at_a_border_of_cells_is_found(alpha):
    """Of Stephenson's second six-bar, with bars that fit its coupler at an angle where cells of the search meet."""
    rng, state, undecided = np.random.default_rng(1), np.zeros(STATE_SIZE), 0
    for k in range(400):
        theta, beta = (0.0 if k % 2 else rng.uniform(-3.0, 3.0)), rng.uniform(-np.pi, np.pi)
        values = {"r1": float(rng.integers(8, 21)), "r4": float(rng.integers(140, 160)), "l1": 0.0, "l2": 0.0}
        misses = Bars("stephenson-2", values).misses(theta, alpha, beta)
        values["l1"], values["l2"] = (np.sqrt(2.0 * miss) for miss, _, _ in misses)
        code = _find(np.array(tie_rows("stephenson-2", values), dtype=float), theta, alpha, beta, state)
        undecided += code == 0
        assert code == 0 or max(abs(np.exp(1j * (state[1:3] - [alpha, beta])) - 1.0)) < 1e-6
    assert undecided <= 4


COUNTS = [pytest.param(8, id="fast"), pytest.param(400, marks=pytest.mark.slow, id="slow")]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", STARTERS)
def test_statuses_are_those_of_paths_of_16384_steps(name, count):
    """Which equal steps along the crank angle follow from the assembly that is meant, found among all.

    Up to one in a hundred may be told to be too near to another assembly.
    """
    rng, kernel = np.random.default_rng(4), LINKAGES[name].mechanism
    designs = random_designs(name, count, rng)
    status = kernel.evaluate_closed_form(columns(kernel, designs)).status
    labels = [kernel.status_labels[code] for code in status]
    theta, alpha, beta = np.deg2rad(LINKAGES[name].table.starts[0])
    undecided = [label.startswith("change_point_at_") for label in labels]
    assert sum(undecided) <= 0.01 * count
    for k in np.flatnonzero(~np.array(undecided)):
        label = labels[k]
        bars = Bars(name, {key: column[k] for key, column in designs.items()})
        known = assemblies(bars, theta, rng)
        if not known:
            assert label == "no_assembly_at_sketch"
            continue
        best = max(known, key=lambda state: np.cos(state[0] - alpha) + np.cos(state[1] - beta))
        (ahead, end), (behind, _) = (follow(bars, theta, best, sense) for sense in (1, -1))
        if ahead == behind == 16384:
            is_back = max(abs(np.exp(1j * np.subtract(end, best)) - 1.0)) < 1e-6
            assert label in (("ok", "no_strokes") if is_back else ("does_not_return",))
        else:  # over more than a turn the group assembles without coming back
            assert label.startswith("crank_blocked_at_") == (ahead + behind < 16384)
            assert label.startswith("crank_blocked_at_") or label == "does_not_return"
    assert len(set(labels)) >= 2


def test_gaps_between_folds_are_found_that_are_narrower_than_cells():
    """Beyond the last design of a line that turns by 1e-4 to 1e-2 of it: 0.4 to 20 deg of the turn are missing."""
    kernel, rng = LINKAGES["stephenson-2"].mechanism, np.random.default_rng(3)
    between, last = find_limits(kernel, random_designs("stephenson-2", 400, rng, 0.5), 20, rng)
    for share in (1e-4, 1e-3, 1e-2):
        closed = kernel.evaluate_closed_form(columns(kernel, between(last * (1.0 + share))))
        assert {kernel.status_labels[code] for code in closed.status} == {"crank_blocked_at_E"}
        count, start, end = closed.metrics[-len(REACH_NAMES) :][:3]
        assert (count == 1).all()
        gaps = 360.0 - (end - start)
        assert (gaps > 0.1).all()
        assert (gaps < 30.0).all()


@pytest.mark.parametrize("shift", [*(11.25 * k / 8.0 for k in range(8)), 180.0, 250.0])
def test_a_gap_is_found_wherever_it_is_between_nodes(shift):
    """One of 0.23 deg, from the folds that Newton's method for all equations leads to; the cells are 11.25 deg wide."""
    values = {"r1": 21.783447675296273, "l1": 92.33770725653338, "q": 65.41802714622632, "l2": 90.61478686188822,
              "l3": 75.1708930584613, "speed": 1.0}  # fmt: skip
    section = STARTERS["stephenson-3-far"]["linkage"]
    crank = {"O": 0, "A": {"radius": "r1", "angle": -shift}}
    section = section | {"links": section["links"] | {"crank": crank}}
    section |= {"sketch": section["sketch"] | {"crank_angle": 30 + shift}}
    linkage = Linkage(section, parameters=values)
    (row,) = explore.evaluate(linkage, values, metrics=REACH_NAMES[:3]).to_dict("records")
    assert linkage.mechanism.status_labels[row["status"]] == "crank_blocked_at_Q"
    folds = np.array([18.1553691808049272, 377.9296149266236212]) + shift
    off = [row[name] - fold for name, fold in zip(REACH_NAMES[1:3], folds - 360.0 * (folds[0] >= 360.0), strict=True)]
    assert row[REACH_NAMES[0]] == 1
    assert np.abs(off).max() <= min(1e-10, 360.0 * row["error"])


def test_a_blocked_group_is_moved_up_to_its_folds():
    """Places at 3e-9 to 20 deg from a fold, against Newton's method for all equations in mpmath: as far as they tell.

    Beside a fold an error of the crank angle grows by 1 over the root of the distance; the digits of places follow.
    """
    entry = SETS["sets"][2]
    section, values = tomllib.loads(SETS["table"])["linkage"], _numbers(entry)
    linkage = Linkage(section | {"sketch": entry["sketch"]}, parameters=values)
    fold = float(entry["assembles_from_the_sketch_deg"][0]["end_deg"])
    for distance in (3e-9, 1e-8, 1e-7, 1e-5, 1e-3, 0.1, 1.0, 20.0):
        angle = fold - distance
        (row,) = explore.simulate(linkage, values, angles=[angle]).to_dict("records")
        with mpmath.workdps(30):
            alpha = _exact(values, mpmath.radians(mpmath.mpf(angle)), row)
            places = 12 * mpmath.expj(mpmath.radians(mpmath.mpf(angle))) + 70 * mpmath.expj(alpha)
            off = abs(places - mpmath.mpc(row["B_x"], row["B_y"]))
        assert off <= 3e-15 * 70.0 / np.sqrt(np.deg2rad(distance) + 1e-15), distance
    with pytest.raises(explore.MotionError, match=r"no motion at 28 deg: .* E is out of reach"):
        explore.simulate(linkage, values, angles=[28.0])


def _exact(values, theta, row):
    """The angle of the coupler near that of a row, by Newton's method in mpmath."""
    alpha, beta = (mpmath.radians(row[f"{link}_angle"]) for link in ("coupler", "rocker"))
    ends = ((mpmath.mpc(70), mpmath.mpc(50, 20), values["l1"]), (mpmath.mpc(60, 55), mpmath.mpc(-5, 75), values["l2"]))
    for _ in range(80):  # each step halves what is off beside a fold
        rows = []
        for b, e, length in ends:
            first, second = -b * mpmath.expj(alpha), e * mpmath.expj(beta)
            vector = values["r4"] - values["r1"] * mpmath.expj(theta) + first + second
            slopes = [(mpmath.conj(arm) * vector).imag for arm in (first, second)]
            rows.append((((mpmath.conj(vector) * vector).real - mpmath.mpf(length) ** 2) / 2, *slopes))
        (e, p, q), (f, r, s) = rows
        alpha, beta = alpha + (q * f - s * e) / (p * s - q * r), beta + (r * e - p * f) / (p * s - q * r)
    return alpha


def test_a_group_that_is_another_one_after_a_turn():
    """It has no full turn, but all intervals that leave out where the turn is cut."""
    name = "stephenson-3-far"
    designs = random_designs(name, 400, np.random.default_rng(6), share=1.0)
    kernel = LINKAGES[name].mechanism
    status = kernel.evaluate_closed_form(columns(kernel, designs)).status
    labels = np.array([kernel.status_labels[code] for code in status])
    values = {key: column[labels == "does_not_return"][0] for key, column in designs.items()}
    with pytest.raises(explore.MotionError, match="the links are assembled in another way"):
        explore.simulate(LINKAGES[name], values)
    cuts = []
    for start in range(0, 360, 30):
        try:
            explore.simulate(LINKAGES[name], values, angles=[float(start), float(start + 30)])
        except explore.MotionError:
            cuts.append(start)
    assert len(cuts) == 1


def test_a_fold_where_the_turn_is_cut_blocks_a_range():
    """The group assembles over more than a turn, from a fold at 0.7 deg on."""
    sketch = {"crank_angle": 30, "P": [95, 50], "Q": [150, 80], "R": [120, 110]}
    values = {"r1": 19.10759, "l1": 93.6244438134995, "q": 59.242754796950386, "l2": 83.3088626797625,
              "l3": 81.1831763974813, "speed": 1.0}  # fmt: skip
    section = STARTERS["stephenson-3-far"]["linkage"] | {"sketch": sketch}
    labels = []
    for changes in ({}, {"range": [-50, 50]}, {"range": [5, 50]}):
        kernel = Linkage(section | changes, parameters=values).mechanism
        closed = kernel.evaluate_closed_form(columns(kernel, {key: np.array([value]) for key, value in values.items()}))
        labels.append(kernel.status_labels[closed.status[0]])
    assert labels == ["does_not_return", "crank_blocked_at_Q", "ok"]


@pytest.mark.parametrize(
    ("section", "values", "link", "point"),
    [
        (STARTERS["stephenson-2"]["linkage"], middle("stephenson-2"), "coupler", "E"),
        (GROUPED["a shaper on a foot"], {"r": 12.0}, "lever", "D"),
    ],
)
def test_copies_of_a_group_are_it_at_their_phases(section, values, link, point):
    linkage = Linkage(section | {"copies": {"b": 120, "c": -90}}, parameters=values)
    values, angles = values | {"speed": 2.0}, np.array([0.0, 50.0, 170.0])
    here, ahead, behind = (explore.simulate(linkage, values, angles=angles + phase) for phase in (0.0, 120.0, -90.0))
    for signal in (f"{point}_x", f"{link}_acceleration"):
        name, kind = signal.split("_", 1)
        for copy, row in (("b", ahead), ("c", behind)):
            # rounding errors of the phase, of accelerations of a few rad/s^2 and places of 100 mm
            np.testing.assert_allclose(here[f"{name}_{copy}_{kind}"], row[signal], rtol=1e-12, atol=1e-12)
    assert Linkage(linkage.content) == linkage


@pytest.mark.parametrize("name", STARTERS)
def test_the_content_of_a_linkage_describes_it(name):
    linkage = LINKAGES[name]
    assert Linkage(linkage.content) == linkage == Linkage(tomllib.loads(linkage.to_toml()))
    first, second = list(linkage.content["branch"])
    assert set(linkage.content["branch"][first]) == {"crank_angle", "angle"}
    turned = linkage.content | {"branch": {key: each | {"angle": each["angle"] + 360.0}
                                           for key, each in linkage.content["branch"].items()}}  # fmt: skip
    assert second in turned["branch"]
    motions = [explore.simulate(each, middle(name), angles=[10.0]) for each in (linkage, Linkage(turned))]
    assert motions[0]["rocker_velocity"].equals(motions[1]["rocker_velocity"])


def test_functions_of_a_group_name_all_that_they_call():
    """An unknown address in machine code is 0, unless another function has named it before."""
    kernel = _kernel(LINKAGES["stephenson-2"].table, "D", "coupler")
    for function in (kernel.close, kernel.fill, kernel.disturbed_fill, kernel.precise_fill, kernel.curve):
        text = function.write()
        called, own = (set(re.findall(rf"{word} ptr @(\w+)\(", text)) for word in ("call", "define"))
        assert called
        assert called <= own | set(function._outer(text))


def test_a_path_along_which_a_group_moves_is_met():
    linkage, values = LINKAGES["stephenson-2"], middle("stephenson-2")
    angles = np.arange(0.0, 360.0, 30.0).tolist()
    motion = explore.simulate(linkage, values, angles=angles)
    target = {
        "kind": "path",
        "point": "D",
        "points": motion[["D_x", "D_y"]].to_numpy().tolist(),
        "crank_angles": angles,
    }
    errors = explore.evaluate(
        linkage,
        values | {"r1": np.array([values["r1"], values["r1"] + 1.0])},
        metrics=["path_error_rms"],
        target=target,
    )["path_error_rms"]
    assert errors[0] < 1e-12
    assert 0.1 < errors[1] < 10.0


def _problem(changes):
    section = STARTERS["stephenson-2"]["linkage"]
    section = {key: each for key, each in (section | changes).items() if each is not None}
    with pytest.raises(ConfigError) as error:
        Linkage(section, parameters=middle("stephenson-2"))
    return str(error.value)


def test_mistakes_of_groups():
    of_coupler = {"crank_angle": 0, "angle": 40}
    assert _problem({"sketch": None}).endswith(
        "linkage: coupler and rocker form a group with bar_1 and bar_2 that no dyad solves; draw a [linkage.sketch], "
        "which chooses its assembly"
    )
    assert "linkage.branch.rocker: is missing beside that of coupler" in _problem(
        {"sketch": None, "branch": {"coupler": of_coupler}}
    )
    assert "linkage.branch.rocker: must be { crank_angle = 40, angle = 110 }, got 'left'" in _problem(
        {"sketch": None, "branch": {"coupler": of_coupler, "rocker": "left"}}
    )
    assert "linkage.branch.rocker.crank_angle: must be that of coupler, 0" in _problem(
        {"sketch": None, "branch": {"coupler": of_coupler, "rocker": {"crank_angle": 3, "angle": 90}}}
    )
    assert "linkage.sketch: the place of B is missing, which the direction of coupler needs" in _problem(
        {"sketch": {"crank_angle": 0, "E": [133, 51], "F": [75, -1]}}
    )
    assert "linkage.copies: the phase of coupler_b must be a number, as of all links of groups" in _problem(
        {"copies": {"b": "phase"}, "parameters": {"phase": {"default": 90}}}
    )


def test_a_group_on_links_that_a_dyad_places_is_refused():
    section = json.loads(json.dumps(STARTERS["stephenson-2"]["linkage"]))
    section["frame"]["G"] = [0, 60]
    section["links"] |= {
        "rod": {"A": 0, "H": 50},
        "lever": {"G": 0, "H": 45},
        "coupler": {"H": 0, "B": 70, "D": [60, 55]},
    }
    with pytest.raises(ConfigError, match="of such groups those of two links with two bars or slots, hung on the"):
        Linkage(section, parameters=middle("stephenson-2"))


def test_a_group_has_no_certificate(tmp_path):
    study, results = tmp_path / "six.toml", tmp_path / "six.h5"
    study.write_text(linkage_starter("stephenson-2").replace("count = 4096", "count = 8"), encoding="utf-8")
    explore.sweep(explore.load_study(study), results)
    with pytest.raises(RequestError, match="cannot be certified: it has a group of links that no dyad solves"):
        explore.certify(results)


@pytest.mark.parametrize("name", [*STARTERS, *(name for name, table in GROUPED.items() if "range" not in table)])
def test_pages_move_groups_as_python_does(name):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    linkage = Linkage(GROUPED[name]) if name in GROUPED else LINKAGES[name]
    values = ({"r": 6.0} if name in GROUPED else middle(name)) | {"speed": 1.0}
    kernel, tangents = linkage.mechanism, [-0.9, -0.3, 0.0, 0.2, 0.77]
    rows = kernel.signal_rows
    parameters = [values[parameter.name] for parameter in kernel.kernel_parameters]
    script = (
        f"const f = {translate(close=kernel.close, fill=kernel.fill)}; const out = new Float64Array({5 * rows});"
        f"const record = new Float64Array({kernel.record_rows}); record.set({parameters}, {kernel.first_parameter});"
        f"f.close(record); f.fill(record, new Float64Array({tangents}), 0, 0, 0, 5, 1, out); console.log(out.join())"
    )
    run = subprocess.run([node], input=script, capture_output=True, text=True, check=True)
    found = np.array([float(word) for word in run.stdout.split(",")]).reshape(5, rows)
    expected = samples_of(kernel.fill, kernel, values, np.array(tangents), 0)
    # of sums in another order
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-10)
