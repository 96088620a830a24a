"""Linkages for tests: those of tests/reference/linkages.json, and random ones; graphs evaluated by mpmath."""

import json
import tomllib
from pathlib import Path

import mpmath
import numpy as np

from explore import Linkage, simulate
from explore.base.lanes.designs import fill_motion_of_design
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.expressions import evaluate_function
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS, operands
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.steps import find_steps

REFERENCE = json.loads((Path(__file__).parent / "reference" / "linkages.json").read_text())
#: Lines of the table of a yoke that two pins in one line hold, and what says in their place that it translates.
SLIDING = {
    'output = "guide"\n': "",
    'guide = { pin = "U", link = "frame", along = ["O", "H"] }\n': "",
    'guide_2 = { pin = "W", link = "frame", along = ["O", "H"] }\n': "",
    "[linkage.sketch]": '[linkage.slides]\nyoke = { link = "frame", direction = ["w", 0] }\n\n[linkage.sketch]',
}
#: Cases whose crank does not turn fully.
PARTIAL = ("peaucellier", "scott-russell")
#: A four-bar of four lengths.
FOUR_BAR = {
    "driver": "crank",
    "frame": {"O": [0, 0], "C": ["r4", 0]},
    "links": {"crank": {"O": 0, "A": "r1"}, "coupler": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"}},
    "branch": {"B": "left of A C"},
}
#: A boom that a cylinder lifts: the cylinder is `offset` to the side of its pivot.
BOOM = {
    "driver": "cylinder",
    "travel": ["low", "high"],
    "frame": {"O": [0, 0], "C": ["c", 0]},
    "links": {"tube": {"O": 0}, "boom": {"C": 0, "B": "b", "P": ["p", 20]}},
    "slots": {"cylinder": {"pin": "B", "link": "tube", "along": [[0, "offset"], [1, "offset"]]}},
    "branch": {"B": "left of O C"},
}
BOOM_LENGTHS = {"low": 60.0, "high": 110.0, "c": 100.0, "b": 50.0, "p": 120.0, "offset": 0.0}
#: A slider that is driven, and a rod whose other end runs in a second slot.
DRIVEN_SLIDER = {
    "driver": "h",
    "travel": ["-t", "t"],
    "frame": {"O": [0, 0]},
    "links": {"rod": {"P": 0, "Q": "l"}},
    "slots": {
        "h": {"pin": "P", "link": "frame", "along": ["O", [1, 0]]},
        "v": {"pin": "Q", "link": "frame", "along": ["O", [0, 1]]},
    },
    "branch": {"Q": "far"},
}
#: An Oldham coupling: the middle disc slides on the driver, and the driven one in it, in a direction aslant.
OLDHAM = {
    "driver": "first",
    "frame": {"O": [0, 0], "Q": ["e", 3]},
    "links": {"first": {"O": 0, "A": 40}, "middle": {"M": 0}, "last": {"Q": 0, "B": 50}},
    "slides": {"middle": {"link": "first", "direction": [1, 0]}, "last": {"link": "middle", "direction": [1, 2]}},
}
#: A bar that slides on the driver, aslant, with a pin in a slot of the frame.
SLIDING_BAR = {
    "driver": "crank",
    "frame": {"O": [0, 0]},
    "links": {"crank": {"O": [3, 4], "A": ["r", 5]}, "bar": {"J": 0, "K": [9, 2]}},
    "slots": {"slot": {"pin": "K", "link": "frame", "along": [[0, 60], [1, 60]]}},
    "slides": {"bar": {"link": "crank", "direction": [1, 2]}},
}
CASES = {case["name"]: case for case in REFERENCE["cases"]}


def trammel(**parts):
    """A bar that turns with its ends on two perpendicular lines."""
    section = {
        "driver": "bar",
        "frame": {"O": [0, 0]},
        "links": {"bar": {"P": 0, "Q": "l", "M": ["m", 0]}},
        "slots": {
            "h": {"pin": "P", "link": "frame", "along": ["O", [1, 0]]},
            "v": {"pin": "Q", "link": "frame", "along": ["O", [0, 1]]},
        },
    }
    return Linkage(section | parts)


def trammel_of_blocks(**parts):
    """The same with blocks that only translate in place of slots."""
    return trammel(
        links={"bar": {"P": 0, "Q": "l", "M": ["m", 0]}, "h": {"P": 0}, "v": {"Q": 0}},
        slots={},
        slides={"h": {"link": "frame", "direction": [1, 0]}, "v": {"link": "frame", "direction": [0, 1]}},
        **parts,
    )


def linkage_of(case):
    text = case["table"]
    if case["name"] == "scotch-yoke":
        for old, new in SLIDING.items():
            assert old in text
            text = text.replace(old, new)
    return Linkage(tomllib.loads(text))


def values_of(case):
    return {name: float(value) for name, value in case["parameters"].items()}


def trace(linkage):
    return Equations(linkage.table, find_steps(linkage.table))


#: Functions of `evaluate_graph` with the digits of mpmath.
MPMATH = {"number": mpmath.mpf, "cos": mpmath.cos, "sin": mpmath.sin, "sqrt": mpmath.sqrt, "arctangent": mpmath.atan2}


def rough_directions(linkage, values, angle):
    """Where the operations that follow groups of links are to begin at a crank angle, rad: off by up to 5e-7."""
    groups = groups_of(find_steps(linkage.table))
    if not groups:
        return {}
    (row,) = simulate(linkage, values, angles=[np.degrees(float(angle))]).to_dict("records")
    directions = [np.deg2rad(row[f"{link}_angle"]) for group in groups for link in (group.first, group.second)]
    parts = [round(float(part), 6) for each in directions for part in (np.cos(each), np.sin(each))]
    return {name: parts[number::4] for number, name in enumerate(PARTS[:4])} | {key: [1.0] for key in FOLLOWS}


def evaluate_graph(numbers, parameters, angle, functions=MPMATH, followed=None):
    """Numbers of a graph by functions of numbers, or of arrays; `angle` in rad, for `followed` see above."""
    graph = numbers[0].graph
    cosine, sine = functions["cos"](angle), functions["sin"](angle)
    inputs = {"@cos": cosine, "@sin": sine}
    inputs |= {f"@versine{k}": 1 - part for k, part in enumerate((cosine, sine, -cosine, -sine))}
    done = {}
    for k in graph.needed(numbers):
        operation, *rest = graph.nodes[k]
        values = [done[each] for each in operands(graph.nodes[k])]
        match operation:
            case "constant":
                done[k] = functions["number"](rest[0]) + rest[1]
            case "input":
                done[k] = inputs[rest[0]] if rest[0] in inputs else functions["number"](parameters[rest[0]])
            case "add" | "exact_sum":
                done[k] = sum(values)
            case "sub":
                done[k] = values[0] - values[1]
            case "mul":
                done[k] = values[0] * values[1]
            case "div":
                done[k] = values[0] / values[1]
            case "neg":
                done[k] = -values[0]
            case "sqrt" | "arctangent":
                done[k] = functions[operation](*values)
            case "abs":
                done[k] = abs(values[0])
            case "max" | "maximum":
                done[k] = max(values)
            case "minimum":
                done[k] = min(values)
            case _ if operation in FOLLOWS + PARTS:
                done[k] = functions["number"](followed[operation][0])  # of tables with one group
            case _ if operation.startswith("sense"):
                done[k] = -1 if values[0] < 0 else 1
            case _:  # of degrees
                done[k] = mpmath.mpf(evaluate_function(operation, *map(float, values)))
    return [done[number.index] for number in numbers]


def wanted_statistics(linkage, reference):
    """Metrics of the reference that the linkage has: the value of each, and the size of its signal, 1 at least."""
    declared = {signal.name: signal.statistics for signal in linkage.mechanism.signals}
    wanted = {}
    for signal in filter(declared.get, reference):
        statistics = {name: float(value) for name, value in reference[signal].items() if not isinstance(value, list)}
        size = max(1.0, *map(abs, statistics.values()))
        wanted |= {f"{signal}_{name}": (statistics[name], size) for name in declared[signal] if name in statistics}
    assert len(wanted) >= 12
    return wanted


def columns(mechanism, designs):
    return np.array(
        [np.broadcast_to(designs[p.name], len(next(iter(designs.values())))) for p in mechanism.kernel_parameters]
    )


def dense(mechanism, designs, count):
    """Mean, variance, least and greatest value of all rows of signals by equal steps, each of shape (n, rows)."""
    angles = (np.arange(count) + 0.5) * 360.0 / count
    half_turns = np.round(angles / 180.0)
    tangents = np.tan(0.5 * np.deg2rad(angles - 180.0 * half_turns))
    anchors, laws = (half_turns % 2).astype(np.int64), np.zeros(count, np.int64)
    signals, result = np.zeros((mechanism.signal_rows, count)), []
    for constants in mechanism.constants(columns(mechanism, designs)).T:
        fill_motion_of_design(
            mechanism.fill,
            np.ascontiguousarray(constants),
            anchors,
            laws,
            tangents,
            0,
            1,
            mechanism.signal_rows,
            signals,
        )
        mean = signals.mean(axis=1)
        result.append((mean, ((signals - mean[:, None]) ** 2).mean(axis=1), signals.min(axis=1), signals.max(axis=1)))
    return [np.array(parts) for parts in zip(*result, strict=True)]


def turns(mechanism, designs):
    return mechanism.evaluate_closed_form(columns(mechanism, designs)).status == 1


def scattered(case, count, rng, share):
    """Designs around a case, each parameter by up to a share of it."""
    return {name: value * (1.0 + share * rng.uniform(-1.0, 1.0, count)) for name, value in values_of(case).items()}


def find_limits(mechanism, designs, count, rng):
    """How to go from designs that turn towards others that do not, by a share of the way, and where the last one turns.

    None if all turn.
    """
    ok = turns(mechanism, designs)
    if ok.all():
        return None
    inside, outside = rng.choice(np.flatnonzero(ok), count), rng.choice(np.flatnonzero(~ok), count)
    low, high = np.zeros(count), np.ones(count)

    def between(share):
        return {name: column[inside] * (1.0 - share) + column[outside] * share for name, column in designs.items()}

    for _ in range(52):
        middle = 0.5 * (low + high)
        moves = turns(mechanism, between(middle))
        low, high = np.where(moves, middle, low), np.where(moves, high, middle)
    return between, low


def near_limits(mechanism, designs, count, rng):
    """Designs that turn beside others that do not, at distances of 1e-6 to 0.3 of the way; None if all turn."""
    if (limits := find_limits(mechanism, designs, count, rng)) is None:
        return None
    between, last = limits
    return between(last * (1.0 - 10.0 ** rng.uniform(-6.0, -0.5, count)))


#: Loads of all kinds, on the crank shaper of the reference.
ALL_LOADS = {
    "gravity": [1.5, "-g"],
    "masses": {
        "lever": {"mass": "m", "centroid": [110, 7], "inertia": 0.002},
        "link": {"mass": 0.3, "centroid": "D"},
        "crank": {"mass": 0.2, "centroid": ["crank / 2", 0], "inertia": "2 * j"},
        "S": "m / 2",
    },
    "forces": {"D": ["f", 3]},
    "torques": {"lever": 0.7, "link": {"torque": -0.4, "against": "lever"}, "crank": 0.05},
    "opposing": {"ram": "cut"},
    "springs": {
        "pull": {"between": ["A", "S"], "rate": 300, "rest": 120},
        "tie": {"between": ["C", "A"], "rate": 150, "rest": 0},
        "buffer": {"between": "ram", "rate": "k", "rest": 20},
        "inner": {"between": "block", "rate": 90, "rest": "lever / 2"},
        "coil": {"between": "lever", "rate": 1.25, "rest": 80},
    },
    "dampers": {
        "oil": {"between": "ram", "rate": 12},
        "grease": {"between": "block", "rate": 3},
        "strut": {"between": ["O", "D"], "rate": 4},
        "hinge": {"between": ["link", "lever"], "rate": 0.03},
        "bush": {"between": "lever", "rate": 0.02},
    },
}

#: Values of the parameters of these loads, with the speed.
AMOUNTS = {"g": 9.81, "m": 0.6, "j": 0.0004, "f": 8.0, "k": 220.0, "cut": 45.0, "speed": 9.0}


def with_loads(case, loads, **units):
    """The linkage of a case under load; with the units of parameters that do not follow from their use."""
    parameters = {name: {"unit": unit} for name, unit in units.items()}
    return Linkage(linkage_of(case).content | {"loads": loads, "parameters": parameters})


def curved_shaper():
    """Forces and torques along curves over a place, an end of the stroke and the crank angle."""
    curves = {
        "cut": {"over": {"point": "D", "along": [1, 2]}, "points": [[-50, 0], [20, 300], [90, 100]], "shape": "cubic"},
        "punch": {"over": "to_greatest", "points": [[0, 40], [3, 90], [70, 0]]},
        "cam": {"over": "crank_angle", "points": [[-30, 0], [100, 2], [330, 0]], "shape": "cubic"},
    }
    loads = {"forces": {"S": ["-2 * cut", "f"]}, "torques": {"lever": "cam"}, "opposing": {"ram": "punch"}}
    return with_loads(CASES["crank-shaper"], loads | {"curves": curves})


def loaded_shaper(without=()):
    """The unit of j does not follow from 2 * j; m alone says that of m / 2."""
    loads = {kind: part for kind, part in ALL_LOADS.items() if kind not in without}
    return with_loads(CASES["crank-shaper"], loads, j="kg m^2")
