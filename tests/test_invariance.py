"""What does not depend on a choice: on the directions of the axes, and on how a window is divided."""

import copy

import numpy as np
import pytest
from linkage_cases import AMOUNTS, CASES, PARTIAL, linkage_of, loaded_shaper, near_limits, scattered, values_of
from loaded_designs import any_rockers, any_sliders

from explore import Linkage
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.registry import MECHANISMS
from explore.model.status import Status
from explore.studies.request.requests import make_request

STATISTICS = ("mean", "rms", "max")
#: Classics that the fast form turns; a dyad of each kind is in them.
TURNED = ("slider-crank", "watt-2", "crank-shaper")
#: Rounding of what is computed here from statistics, relative.
ROUNDING = 1e-15
#: What has loads on all of its parts.
LOADED = ("crank-rocker", "slider-crank", "loaded table")


def turned(content, quarters):
    """A table whose frame, and links that only translate, are some quarters of a turn further."""
    result = copy.deepcopy(content)
    links = {"frame": result["frame"], **{name: result["links"][name] for name in result.get("slides", {})}}
    for points in links.values():
        points.update({point: _turn(place, quarters) for point, place in points.items()})
    for slot in result.get("slots", {}).values():
        if slot["link"] in links:
            slot["along"] = [_turn(end, quarters, links[slot["link"]]) for end in slot["along"]]
    for slide in result.get("slides", {}).values():
        if slide["link"] in links:
            slide["direction"] = _turn(slide["direction"], quarters)
    return result


def _turn(place, quarters, points=()):
    """A place further by some quarters of a turn, or the name of one of the points."""
    if isinstance(place, str) and place in points:
        return place
    x, y = place if isinstance(place, list) else (place, 0)
    return [[x, y], [f"-({y})", x], [f"-({x})", f"-({y})"], [y, f"-({x})"]][quarters]


def statistics(mechanism, signal, window, designs):
    """Columns of means, rms and maxima of a signal, by statistic, and of errors and statuses."""
    names = [f"{signal}_{kind}" for kind in STATISTICS]
    found = evaluate_columns(make_request(mechanism, metrics=names, window=window, tolerance=1e-9), designs).columns
    return {kind: found[name] for kind, name in zip(STATISTICS, names, strict=True)} | {
        "error": found["error"] + ROUNDING, "met": found["status"] == Status.OK,
    }  # fmt: skip


@pytest.mark.parametrize(
    "name", [each if each in TURNED else pytest.param(each, marks=pytest.mark.slow) for each in CASES]
)
def test_statistics_do_not_depend_on_the_axes(name):
    """A quarter of a turn rounds nothing, but changes which terms cancel and from where angles are counted."""
    if name in PARTIAL:
        pytest.skip("its crank does not turn fully")
    rng, content, case = np.random.default_rng(4), linkage_of(CASES[name]).content, CASES[name]
    designs = near_limits(Linkage(content).mechanism.for_signals(()), scattered(case, 200, rng, 0.25), 60, rng)
    designs = designs or scattered(case, 60, rng, 0.25)
    mechanisms = [Linkage(turned(content, quarters)).mechanism for quarters in range(4)]
    moving = {f"{each}_{rate}" for each in content["links"] for rate in ("velocity", "acceleration")}
    moving |= {f"{each}_{rate}" for each in content.get("slots", {}) for rate in ("position", "velocity")}
    for signal in moving & {each.name for each in mechanisms[0].signals}:
        first, *others = (statistics(each, signal, "cycle", designs) for each in mechanisms)
        for other in others:
            met, error = first["met"] & other["met"], first["error"] + other["error"]
            # a row beside the tolerance may be met in one of both
            assert np.count_nonzero(met) >= 0.8 * np.count_nonzero(first["met"])
            for kind in STATISTICS:
                size = np.maximum(first["rms"], np.abs(first["max"])) if kind == "max" else first["rms"]
                assert (np.abs(other[kind] - first[kind]) <= size * error)[met].all(), (signal, kind)


def loaded(name):
    """A mechanism under loads and random designs of it."""
    if name == "loaded table":
        mechanism, rng = loaded_shaper().mechanism, np.random.default_rng(1)
        values = values_of(CASES["crank-shaper"]) | AMOUNTS
        return mechanism, {each.name: values[each.name] * rng.uniform(0.9, 1.1, 60) for each in mechanism.parameters}
    mechanism = MECHANISMS[name]
    names = {parameter.name for parameter in (mechanism.extended or mechanism).parameters}
    drawn = {"crank-rocker": any_rockers, "slider-crank": any_sliders}[name](150, 7)
    return mechanism, {each: values for each, values in drawn.items() if each in names}


def signals_of(mechanism):
    """Names of signals that every window has, at most some twenty of them."""
    signals = [each.name for each in (mechanism.extended or mechanism).signals if not each.only_in]
    return signals[:: 1 + len(signals) // 20]


def check_parts(signal, whole, parts, shares):
    """Means and mean squares of a whole are those of its parts by their shares, and its maximum is one of theirs."""
    error = whole["error"] + sum(part["error"] for part in parts)
    met = np.logical_and.reduce([whole["met"], *(part["met"] for part in parts)])
    rms = np.sqrt(sum(share * part["rms"] ** 2 for share, part in zip(shares, parts, strict=True)))
    mean = sum(share * part["mean"] for share, part in zip(shares, parts, strict=True))
    largest = np.maximum.reduce([part["max"] for part in parts])
    assert (np.abs(whole["rms"] - rms) <= rms * error)[met].all(), signal
    assert (np.abs(whole["mean"] - mean) <= rms * error)[met].all(), signal
    assert (np.abs(whole["max"] - largest) <= np.maximum(rms, np.abs(largest)) * error)[met].all(), signal
    return np.count_nonzero(met)


@pytest.mark.parametrize("name", LOADED)
def test_strokes_make_up_the_turn(name):
    mechanism, designs = loaded(name)
    ratio = evaluate_columns(make_request(mechanism, metrics=["time_ratio"]), designs).columns["time_ratio"]
    shares, met = (ratio / (1.0 + ratio), 1.0 / (1.0 + ratio)), 0
    for signal in signals_of(mechanism):
        whole, *parts = (statistics(mechanism, signal, window, designs) for window in ("cycle", "drive", "return"))
        met += check_parts(signal, whole, parts, shares)
    assert met > 100


@pytest.mark.parametrize("name", LOADED)
@pytest.mark.parametrize("angles", [(-30.0, 90.0, 201.0), (180.0, 180.001, 360.0), (270.0, 360.0, 540.0)])
def test_two_intervals_make_up_one(name, angles):
    mechanism, designs = loaded(name)
    first, middle, last = angles
    intervals = [{"from": begin, "to": end} for begin, end in ((first, last), (first, middle), (middle, last))]
    shares, met = ((middle - first) / (last - first), (last - middle) / (last - first)), 0
    for signal in signals_of(mechanism):
        whole, *parts = (statistics(mechanism, signal, interval, designs) for interval in intervals)
        met += check_parts(signal, whole, parts, shares)
    assert met > 100
