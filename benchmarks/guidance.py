"""Measure what `explore.simulate` knows of the methods; ``python benchmarks/guidance.py`` writes data/guidance.csv.

For every method and setting and the distances from the change point of `explore stability`: the largest error of
angles, velocities and accelerations over a turn of 72 steps, and the CPU time of a turn over that of the closed form.
Peers are left out: a choice must not depend on what is installed.
"""

import csv
import math
from pathlib import Path

import numpy as np

import explore
from explore.comparison import reference
from explore.comparison.stability import grid
from explore.comparison.timing import cpu_seconds
from explore.comparison.verdicts import Verdict, judge
from explore.methods.contract import Capability, Level, Task, label
from explore.methods.registry import METHODS

TARGET = Path(explore.__file__).parent / "data" / "guidance.csv"
#: A verdict other than on errors makes a setting useless there.
USABLE = (Verdict.RIGHT, Verdict.INACCURATE)


def main() -> None:
    designs = grid()
    turns = designs.margin > 0.0
    lengths, margins = designs.lengths[turns], designs.margin[turns]
    branch = np.ones(len(lengths))
    angles = np.tile(0.5 * np.pi + np.linspace(0.0, 2.0 * np.pi, 73), (len(lengths), 1))
    task = Task(lengths, branch, angles, Level.ACCELERATIONS)
    exact = reference.exact_motion(lengths, branch, angles)
    methods = [m for settings in METHODS.values() for m in settings if Capability.PEER not in m.capabilities]
    seconds = {label(method): cpu_seconds(lambda m=method: m.solve(task.part(slice(0, 4)))) for method in methods}
    rows = []
    for method in methods:
        judgement = judge(task, method.solve(task), exact, 0.1)
        for i, margin in enumerate(margins):
            usable = judgement.verdict[i] in USABLE
            rows.append(
                {
                    "setting": label(method),
                    "margin": f"{margin:.6e}",
                    "error": f"{judgement.largest[:, i].max() if usable else math.inf:.2e}",
                    "cost": f"{seconds[label(method)] / seconds['closed-form']:.3g}",
                }
            )
    with TARGET.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    print(f"{len(rows)} rows of {len(methods)} settings -> {TARGET}")


if __name__ == "__main__":
    main()
