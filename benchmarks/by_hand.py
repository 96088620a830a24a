"""Two mechanisms as another package would write them, signals by hand and no singularities declared, over full turns.

Run with ``python benchmarks/by_hand.py [FOLDER]``: a Watt six-bar and a Whitworth quick return. With FOLDER, a checkout
of another edition, both editions in turns, one process each, on one core.
"""

import math
import sys
import time
from collections.abc import Callable
from enum import IntEnum

import numpy as np
from timing import edition_times, serve

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.subroutines import subroutine
from explore.model.mechanism import Mechanism
from explore.model.quantities import Metric, Parameter, Signal
from explore.model.window import Window

DESIGNS, REPETITIONS, TOLERANCES = 16_384, 5, (1e-6, 1e-9, 1e-12)
WINDOWS = (Window("cycle", "the full turn", "turn", needs_stroke=False),)
#: Status of a design that is not proved to turn.
BLOCKED = 2


class Watt(IntEnum):
    STATUS = 10
    CRANK = 11
    COUPLER = 12
    ROCKER = 13
    GROUND = 14
    ARM = 15
    TILT = 16
    LINK = 17
    OUTPUT = 18
    RIGHT = 19
    UP = 20
    MARGIN = 21


WATT_RANGES = {
    "crank": (20.0, 35.0), "coupler": (80.0, 110.0), "rocker": (55.0, 75.0), "ground": (85.0, 105.0),
    "arm": (30.0, 50.0), "tilt": (0.0, 360.0), "link": (70.0, 110.0), "output": (60.0, 90.0),
    "right": (60.0, 110.0), "up": (-20.0, 20.0),
}  # fmt: skip


@compiled(CLOSE_SIGNATURE)
def close_watt(record):
    for lane in range(LANES):
        for row in range(10):
            record[row * LANES + lane] = record[(Watt.CRANK + row) * LANES + lane]
        record[5 * LANES + lane] = math.radians(record[Watt.TILT * LANES + lane])
        crank, coupler = record[Watt.CRANK * LANES + lane], record[Watt.COUPLER * LANES + lane]
        rocker, ground = record[Watt.ROCKER * LANES + lane], record[Watt.GROUND * LANES + lane]
        arm, link = record[Watt.ARM * LANES + lane], record[Watt.LINK * LANES + lane]
        output, right, up = (
            record[Watt.OUTPUT * LANES + lane], record[Watt.RIGHT * LANES + lane], record[Watt.UP * LANES + lane]
        )  # fmt: skip
        first = min(coupler + rocker - ground - crank, ground - crank - abs(coupler - rocker))
        distance = math.hypot(right, up)
        second = min(link + output - distance - arm, abs(distance - arm) - abs(link - output))
        record[Watt.MARGIN * LANES + lane] = margin = min(first, second)
        record[Watt.STATUS * LANES + lane] = 1.0 if margin > 0.0 else 1.0 * BLOCKED


@subroutine(inlined=True)
def _dyad(x, y, vx, vy, ax, ay, px, py, link, rocker):
    """Place of the joint of a link from (x, y) and a rocker about (px, py), rate and acceleration of the rocker."""
    dx, dy = px - x, py - y
    square = dx * dx + dy * dy
    along = 0.5 * (square + link * link - rocker * rocker) / square
    across = math.sqrt(link * link / square - along * along)
    lx, ly = along * dx - across * dy, along * dy + across * dx
    rx, ry = lx - dx, ly - dy
    cross = rx * ly - ry * lx
    rate = (vx * lx + vy * ly) / cross
    wx, wy = -rate * ry - vx, rate * rx - vy
    acceleration = (ax * lx + ay * ly + rate * rate * (rx * lx + ry * ly) - wx * wx - wy * wy) / cross
    return rx, ry, rate, acceleration


@compiled(FILL_SIGNATURE, fast=True)
def fill_watt(constants, tangents, anchor, _law, _variant, count, _needs, out):
    sign = 1.0 if anchor == 0 else -1.0
    for j in range(count):
        for lane in range(LANES):
            crank, coupler = constants[lane], constants[LANES + lane]
            rocker, ground, arm = constants[2 * LANES + lane], constants[3 * LANES + lane], constants[4 * LANES + lane]
            link, output = constants[6 * LANES + lane], constants[7 * LANES + lane]
            right, up = constants[8 * LANES + lane], constants[9 * LANES + lane]
            u = tangents[j * LANES + lane]
            scale = sign * crank / (1.0 + u * u)
            x, y = (1.0 - u * u) * scale, 2.0 * u * scale
            rx, ry, rate, acceleration = _dyad(x, y, -y, x, -x, -y, ground, 0.0, coupler, rocker)
            share = arm / rocker
            bx, by = share * math.cos(constants[5 * LANES + lane]), share * math.sin(constants[5 * LANES + lane])
            qx, qy = rx * bx - ry * by, rx * by + ry * bx
            vx, vy = -rate * qy, rate * qx
            ax, ay = -acceleration * qy - rate * rate * qx, acceleration * qx - rate * rate * qy
            sx, sy, of_output, its_rate = _dyad(qx, qy, vx, vy, ax, ay, right, up, link, output)
            at = 6 * j * LANES + lane
            out[at], out[at + LANES] = rate, acceleration
            out[at + 2 * LANES], out[at + 3 * LANES] = of_output, its_rate
            out[at + 4 * LANES], out[at + 5 * LANES] = right + sx, up + sy


WATT = Mechanism(
    name="watt-by-hand",
    summary="a four-bar whose rocker moves a second one",
    parameters=tuple(
        Parameter(name, "deg" if name == "tilt" else "mm", name, lower=-math.inf if low <= 0.0 else 0.0)
        for name, (low, _) in WATT_RANGES.items()
    ),
    signals=(
        Signal("rocker_velocity", "1", "rate of the rocker", 0, 1),
        Signal("rocker_acceleration", "1", "its rate", 1, 1, pole_order=4, derivative_of="rocker_velocity"),
        Signal("output_velocity", "1", "rate of the output", 2, 1),
        Signal("output_acceleration", "1", "its rate", 3, 1, pole_order=4, derivative_of="output_velocity"),
        Signal("joint_x", "mm", "place of the output's joint", 4, 1, relative_to="output"),
        Signal("joint_y", "mm", "place of the output's joint", 5, 1, relative_to="output"),
    ),
    metrics=(Metric("margin", "mm", "margin of the loops", "max"),),
    windows=WINDOWS,
    output_signals={"": "output_velocity"},
    zero_mean=frozenset(),
    default_metrics={"": ("margin",)},
    objectives=("margin",),
    kernel_version="1",
    n_constants=Watt.STATUS,
    rows=Watt,
    signal_rows=6,
    close=close_watt,
    fill=fill_watt,
    default_window="cycle",
)


class Whitworth(IntEnum):
    STATUS = 4
    CRANK = 5
    OFFSET = 6
    ARM = 7
    LINK = 8
    MARGIN = 9


WHITWORTH_RANGES = {"crank": (60.0, 90.0), "offset": (15.0, 40.0), "arm": (40.0, 80.0), "link": (150.0, 250.0)}


@compiled(CLOSE_SIGNATURE)
def close_whitworth(record):
    for lane in range(LANES):
        for row in range(4):
            record[row * LANES + lane] = record[(Whitworth.CRANK + row) * LANES + lane]
        crank, offset, arm, link = (
            record[lane], record[LANES + lane], record[2 * LANES + lane], record[3 * LANES + lane]
        )  # fmt: skip
        record[Whitworth.MARGIN * LANES + lane] = margin = min(crank - offset, link - arm)
        record[Whitworth.STATUS * LANES + lane] = 1.0 if margin > 0.0 else 1.0 * BLOCKED


@compiled(FILL_SIGNATURE, fast=True)
def fill_whitworth(constants, tangents, anchor, _law, _variant, count, _needs, out):
    sign = 1.0 if anchor == 0 else -1.0
    for j in range(count):
        for lane in range(LANES):
            crank, offset = constants[lane], constants[LANES + lane]
            arm, link = constants[2 * LANES + lane], constants[3 * LANES + lane]
            u = tangents[j * LANES + lane]
            scale = sign * crank / (1.0 + u * u)
            x, y = (1.0 - u * u) * scale, 2.0 * u * scale
            # the pin from the pivot of the slotted arm, which is `offset` below that of the crank
            px, py = x, y + offset
            square = px * px + py * py
            rate = (crank * crank + offset * y) / square
            change = offset * x / square - 2.0 * rate * offset * x / square
            length = math.sqrt(square)
            cosine, sine = px / length, py / length
            rise = arm * sine
            far = math.sqrt(link * link - rise * rise)
            ride = -arm * sine - rise * arm * cosine / far
            bend = -arm * cosine - (arm * arm * (cosine * cosine - sine * sine)) / far
            bend = bend - (rise * arm * cosine) * (rise * arm * cosine) / (far * far * far)
            at = 4 * j * LANES + lane
            out[at], out[at + LANES] = rate, arm * cosine + far
            out[at + 2 * LANES], out[at + 3 * LANES] = ride * rate, bend * rate * rate + ride * change


WHITWORTH = Mechanism(
    name="whitworth-by-hand",
    summary="a crank that turns a slotted arm, which moves a ram",
    parameters=tuple(Parameter(name, "mm", name) for name in WHITWORTH_RANGES),
    signals=(
        Signal("arm_velocity", "1", "rate of the arm", 0, 1),
        Signal("ram_position", "mm", "place of the ram", 1, 1, relative_to="link"),
        Signal("ram_velocity", "mm", "its rate", 2, 1, relative_to="arm", derivative_of="ram_position"),
        Signal(
            "ram_acceleration", "mm", "its rate", 3, 1, relative_to="arm", pole_order=4, derivative_of="ram_velocity"
        ),
    ),
    metrics=(Metric("margin", "mm", "margin of the arms", "max"),),
    windows=WINDOWS,
    output_signals={"": "ram_velocity"},
    zero_mean=frozenset(),
    default_metrics={"": ("margin",)},
    objectives=("margin",),
    kernel_version="1",
    n_constants=Whitworth.STATUS,
    rows=Whitworth,
    signal_rows=4,
    close=close_whitworth,
    fill=fill_whitworth,
    default_window="cycle",
)

#: Mechanism and ranges of its designs, by name.
BY_HAND = {"watt": (WATT, WATT_RANGES), "whitworth": (WHITWORTH, WHITWORTH_RANGES)}
#: Statistics of each signal.
STATISTICS = {"moments": ("mean", "std"), "extremes": ("min", "max")}


def make_measurement() -> Callable[[str], list[float]]:
    """A function that gives the CPU microseconds per design that turns, and the nodes, of a job."""
    from explore.evaluation.evaluate import evaluate_columns
    from explore.studies.request.requests import make_request

    def measure(job: str) -> list[float]:
        name, kind, tolerance = job.split()
        mechanism, ranges = BY_HAND[name]
        rng = np.random.default_rng(0)
        designs = {each: rng.uniform(*bounds, DESIGNS) for each, bounds in ranges.items()}
        metrics = [f"{signal.name}_{s}" for signal in mechanism.signals[:4] for s in STATISTICS[kind]]
        request = make_request(mechanism, metrics=metrics, window="cycle", tolerance=float(tolerance))
        evaluate_columns(request, {each: column[:1] for each, column in designs.items()})
        start = time.process_time()
        columns = evaluate_columns(request, designs).columns
        spent = time.process_time() - start
        turns = columns["status"] != BLOCKED
        return [spent / np.count_nonzero(turns) * 1e6, float(columns["nodes"][turns].mean()),
                float(np.mean(columns["status"][turns] == 1))]  # fmt: skip

    return measure


def main() -> None:
    jobs = {f"{name} {kind} {tolerance:g}": f"{name} {kind} {tolerance:g}" for name in BY_HAND for kind in STATISTICS
            for tolerance in TOLERANCES}  # fmt: skip
    if len(sys.argv) > 1:
        times = edition_times(__file__, sys.argv[1], jobs, REPETITIONS)
    else:
        measure = make_measurement()
        times = {job: ([[0.0, 0.0, 0.0]], [measure(job) for _ in range(REPETITIONS)]) for job in jobs}
    for job in jobs:
        other, here = (np.median(np.array(measured), axis=0) for measured in times[job])
        print(f"{job:26s}{other[0]:8.2f} us{here[0]:8.2f} us{other[0] / here[0]:7.1f} x{1e6 / here[0]:12,.0f} designs/s"
              f"{other[1]:7.0f} nodes{here[1]:7.0f} nodes; met {here[2]:.4f}")  # fmt: skip


if __name__ == "__main__":
    serve(make_measurement()) if "--serve" in sys.argv else main()
