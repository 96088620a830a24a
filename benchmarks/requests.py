"""Requests by explore and by peers written for one question each, all to 1e-9: ``python benchmarks/requests.py``.

CPU time per design, interleaved. The peers are NumPy, JAX (``pip install ".[jax]"``) and a loop compiled by Numba whose
lanes are designs; `request_peers` has them. They take textbook formulas and the same number of samples for all designs:
the least even one with which the worst of all designs has an error up to the tolerance. `explore` chooses nodes for
each design without that knowledge, checks that it moves, and returns a bound of its error. After these come requests
without peers.
"""

import itertools
import statistics
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import request_peers as peers
from timing import cpu_times

import explore
from explore.evaluation.evaluate import evaluate_columns
from explore.studies.designs.solved_lengths import solve
from explore.studies.designs.spaces import SolvedLength
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

DESIGNS, REPETITIONS, TOLERANCE = 16_384, 9, 1e-9
CONFIGS = Path(__file__).parents[1] / "configs"
FOUR_BAR = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}
SLIDER = {"crank": (20, 40), "rod": (100, 150), "mass": (1, 5), "constant_force": (-500, -100), "speed": (10, 30)}
LOADED = FOUR_BAR | {"constant_torque": (50, 100), "inertia": (0.1, 1), "speed": (10, 30)}
POINTS = [f"{name}_{axis}" for name in "PQRS" for axis in ("along", "across")]
COUPLER = FOUR_BAR | dict.fromkeys(POINTS, (-300, 900))
WATT = {
    "r1": (20, 28), "r2": (85, 95), "r3": (65, 75), "r4": (98, 102), "bx": (45, 55), "by": (-35, -25),
    "r5": (85, 95), "r6": (75, 80), "fx": (190, 200),
}  # fmt: skip
PINNED = {"r": (20, 40), "l": (100, 150), "e": (0, 10), "speed": (10, 30)}
SHAPER = {"height": (100, 140), "r": (30, 60), "l": (255, 265), "k": (78, 82), "rise": (130, 160), "speed": (1, 5)}
RATES = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")


def moments(signals):
    """Names of the means and variances of signals."""
    return [f"{signal}_{statistic}" for statistic in ("mean", "variance") for signal in signals]


def classic(name):
    """The table of `explore init --linkage NAME`."""
    return explore.load_linkage(Path(explore.__file__).parent / "data" / "linkages" / f"{name}.toml")


def watt():
    """A table whose branch is that of `request_peers.watt_rates`."""
    return classic("watt-2")


def shaper():
    """A crank shaper whose ram and block rub and cut."""
    loads = {"opposing": {"ram": 300.0}, "friction": {"block": 0.1}, "masses": {"S": 2.0}, "gravity": [0, -9.81]}
    return explore.Linkage(classic("crank-shaper").content | {"loads": loads})


def rough_pins():
    """A table of a slider-crank whose three pins rub, with a mass on the slider."""
    pins = {name: {"coefficient": 0.1, "radius": 6} for name in "OAB"}
    return explore.Linkage(classic("slider-crank").content | {"loads": {"masses": {"B": 2.0}, "friction": pins}})


#: Title, mechanism, ranges of parameters, question, and the peers' question.
COMPARED = (
    ("turn: 4 rates, moments", "crank-rocker", FOUR_BAR, {"metrics": moments(RATES)}, peers.MOMENTS),
    ("stroke: 4 rates, moments", "crank-rocker", FOUR_BAR, {"metrics": moments(RATES), "window": "drive"},
     peers.STROKE),
    ("torque rms", "slider-crank", SLIDER, {"metrics": ["drive_torque_rms"]}, peers.TORQUE),
    ("peak force", "crank-rocker", LOADED, {"metrics": ["coupler_force_peak"]}, peers.FORCE),
    ("4 points, velocity rms", "crank-rocker", COUPLER,
     {"metrics": [f"{name}_velocity_rms" for name in "PQRS"], "points": list("PQRS")}, peers.POINTS),
    ("Watt II: output, moments", watt, WATT,
     {"metrics": moments(("output_velocity", "output_acceleration"))}, peers.WATT),
)  # fmt: skip


FRICTION = SLIDER | {"friction": (0.05, 0.2)}
GROOVE = {
    "rod": (80, 200), "slider_speed": (100, 400), "speed": (3, 12), "reversal_time": (0.01, 0.06), "mass": (0.5, 5),
    "friction": (0.02, 0.3),
}  # fmt: skip
TRACED = FOUR_BAR | {"M_along": (-300, 900), "M_across": (-300, 900)}


def oval(count):
    """A closed path of so many points."""
    turns = np.arange(count) * (2 * np.pi / count)
    points = np.stack([300 + 120 * np.cos(turns) + 15 * np.cos(2 * turns), 200 + 60 * np.sin(turns)], axis=1)
    return {"kind": "path", "points": points.tolist(), "closed": True}


GEARS = {"growth": (1.1, 2.0), "sector": (3.0, 5.5)}
#: Requests without peers: title, mechanism, ranges of parameters, question.
ALONE = (
    ("pin force peak, inertia", "crank-rocker", LOADED, {"metrics": ["pin_force_peak"], "window": "drive"}),
    ("torque rms, inertia", "crank-rocker", LOADED, {"metrics": ["drive_torque_rms"]}),
    ("positive work, inertia", "crank-rocker", LOADED, {"metrics": ["positive_work"]}),
    ("torque rms, friction", "slider-crank", FRICTION, {"metrics": ["drive_torque_rms"]}),
    ("table, torque rms, friction", shaper, SHAPER, {"metrics": ["drive_torque_rms"]}),
    ("table, torque rms, rough pins", rough_pins, PINNED, {"metrics": ["drive_torque_rms"]}),
    ("default columns, friction", "variable-crank", GROOVE, {}),
    ("perimeter", "gears", GEARS, {"metrics": ["perimeter"]}),
    ("1 point, velocity peak", "crank-rocker", COUPLER, {"metrics": ["P_velocity_max"], "points": ["P"]}),
    ("1 point, curvature peak", "crank-rocker", COUPLER, {"metrics": ["P_curvature_peak"], "points": ["P"]}),
    *(
        (f"closed path of {count} points", "crank-rocker", TRACED,
         {"metrics": ["path_error_rms"], "points": ["M"], "target": oval(count)})
        for count in (12, 60, 500)
    ),
)  # fmt: skip


def drawn(ranges, count=DESIGNS):
    """Designs, uniform in their ranges."""
    rng = np.random.default_rng(0)
    return {name: rng.uniform(*bounds, count) for name, bounds in ranges.items()}


def compare(title, mechanism, ranges, question, peer):
    """Print a line: the time of `explore`, and those of the peers in its."""
    designs = drawn(ranges)
    source = mechanism() if callable(mechanism) else mechanism
    options = {"window": "cycle", "drive": "slow", **question}
    if callable(mechanism):
        del options["drive"]
    parameters = np.array(list(designs.values()))
    many = peers.MANY_FOR_PEAKS if peer.statistic == "peak" else peers.MANY  # only rounding remains
    exact = peers.by_numpy(peer, many, parameters)
    count = next(n for n in range(8, many, 2) if peer.error(peers.by_numpy(peer, n, parameters), exact) <= TOLERANCE)

    def by_explore():
        arrays = explore.evaluate(source, designs, **options, tolerance=TOLERANCE, table=False)
        return np.array([arrays[name] for name in options["metrics"]]), arrays["nodes"].mean()

    jobs = {"explore": by_explore, "NumPy": lambda: (peers.by_numpy(peer, count, parameters), count)}
    makers = {"Numba": peers.numba_function} | ({"JAX": peers.jax_function} if find_spec("jax") else {})
    for name, make in makers.items():
        function = make(peer, count)
        jobs[name] = lambda function=function: (np.asarray(function(parameters)), count)
    seconds = {name: statistics.median(times) for name, times in cpu_times(jobs, REPETITIONS).items()}
    values, nodes = jobs.pop("explore")()
    own = f"{seconds['explore'] / DESIGNS * 1e9:6,.0f} ns, {nodes:.1f} nodes, error {peer.error(values, exact):.0e}"
    others = ", ".join(f"{name} {seconds[name] / seconds['explore']:.2f} x" for name in jobs)
    print(f"{title:30}{own}; {count} nodes: {others}")


def measure(title, request, designs):
    """Print the rate of a request without a peer.

    Two orders of the designs take turns, because the last errors of a target are remembered.
    """
    evaluation = evaluate_columns(request, designs)
    turns = itertools.cycle(({name: column[::-1] for name, column in designs.items()}, designs))
    times = cpu_times({title: lambda: evaluate_columns(request, next(turns))}, 3)[title]
    count, columns = len(evaluation.columns["error"]), evaluation.columns
    moves = columns["nodes"] > 0
    met = np.mean(columns["error"][moves] <= request.tolerance) if moves.any() else 1.0
    nodes = columns["nodes"][moves].mean() if moves.any() else 0.0
    print(f"{title:30}{count / statistics.median(times):12,.0f} designs/s{nodes:9.1f} nodes; met {met:.4f}")


def measure_solving(title, name, metric, value):
    """Print the rate at which a length of crank-rockers is solved for."""
    designs = {each: column for each, column in drawn(FOUR_BAR).items() if each != name}
    solved = SolvedLength(name, make_request(find_mechanism("crank-rocker"), metrics=[metric]), value)
    (times,) = cpu_times({title: lambda: solve(solved, designs)}, 3).values()
    print(f"{title:30}{DESIGNS / statistics.median(times):12,.0f} designs/s")


def main() -> None:
    """Print the comparisons, then the requests without peers, then those of studies."""
    for request in COMPARED:
        compare(*request)
    for title, mechanism, ranges, question in ALONE:
        source = mechanism() if callable(mechanism) else mechanism
        options = {"window": "cycle"} | question
        declared = find_mechanism(source, options.pop("points", ()), options.pop("target", None))
        names = {parameter.name for parameter in declared.parameters}
        designs = {name: column for name, column in drawn(ranges, 4096).items() if name in names}
        measure(title, make_request(declared, **options), designs)
    measure_solving("crank for a swing of 20°", "crank", "swing_angle", 20.0)
    for path in sorted(CONFIGS.glob("*.toml")):
        study = explore.load_study(path)
        measure(f"configs/{path.name}", study.request, study.space.designs(0, min(4096, study.space.n_designs)))


if __name__ == "__main__":
    main()
