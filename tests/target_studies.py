"""Studies of crank-rockers with a target of each kind."""

import explore

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10]]
POSES = [[0, 0, 0], [10, 0, 5], [12, 8, 15], [5, 12, 25], [-3, 8, 20], [-2, 2, 8]]
TABLE = [[0, 0], [20, 41], [40, 70], [60, 90]]
TARGETS = {
    "path": {"points": SQUARE, "closed": True}, "poses": {"poses": POSES}, "function": {"table": TABLE},
    "dwell": {"angle": 60},
}  # fmt: skip
#: Places of a linkage that carries a point.
PLACES = {
    "crank": {"min": 2, "max": 10}, "coupler": 30, "rocker": 30, "ground": 32, "branch": [1, -1],
    "crank_pivot_x": {"min": -30, "max": 30}, "crank_pivot_y": {"min": -30, "max": 30},
    "ground_angle": {"min": 0, "max": 360},
}  # fmt: skip
#: Lengths of a linkage whose output has the target.
LENGTHS = {
    "crank": {"min": 20, "max": 90}, "coupler": {"min": 20, "max": 150}, "rocker": {"min": 20, "max": 120},
    "ground": 100,
}  # fmt: skip
PARAMETERS = {
    "path": PLACES, "poses": PLACES | {"body_angle": {"min": 0, "max": 360}}, "dwell": LENGTHS,
    "function": LENGTHS | {
        "branch": [1, -1], "input_start": {"min": 0, "max": 360}, "output_start": {"min": -180, "max": 180},
    },
}  # fmt: skip


def study_of(kind, **changes):
    """The study of a target, with changes of its arguments."""
    arguments = {
        "mechanism": "crank-rocker", "target": {"kind": kind} | TARGETS[kind], "parameters": PARAMETERS[kind],
        "sampling": {"method": "sobol", "count": 1024, "seed": 1},
        "constraints": {"transmission_angle_min": {"min": 20}},
    }  # fmt: skip
    if kind in ("path", "poses"):
        arguments["points"] = {"M": {"along": {"min": 5, "max": 30}, "across": {"min": -20, "max": 20}}}
    if kind == "dwell":
        arguments["constraints"] |= {"swing_angle": {"min": 30}}
    return explore.Study(**arguments | changes)
