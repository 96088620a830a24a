"""Tables of groups of links that slots tie, and their motion by Newton's method on the equations of all joints."""

import numpy as np

CRANK = {"O": 0, "A": "r"}
#: Groups that slots tie: of the second link, of the first one, of the driver and of the frame, with pins of all others.
_GROUPED = {
    "a shaper on a foot": {
        "frame": {"O": [0, 0], "E": [-60, -110]},
        "links": {"crank": CRANK, "foot": {"E": 0, "C": 60}, "lever": {"C": 0, "D": 270}},
        "slots": {
            "block": {"pin": "A", "link": "lever", "along": ["C", "D"]},
            "ram": {"pin": "D", "link": "frame", "along": [[0, 145], [1, 145]]},
        },
        "sketch": {"crank_angle": 0, "C": [0, -110], "D": [90, 145]},
    },
    "a slot of the second link": {
        "frame": {"O": [0, 0], "G": [150, 10]},
        "links": {
            "crank": CRANK, "coupler": {"A": 0, "P": [100, 20], "S": [80, 70]}, "rocker": {"G": 0, "F": [40, 60]},
            "bar": {"S": 0, "F": 102},
        },
        "slots": {"guide": {"pin": "P", "link": "rocker", "along": [[3, 2], [4, 2]]}},
        "sketch": {"crank_angle": 0, "P": [107, 37], "S": [79, 83], "F": [84, -19]},
    },
    "a slot of the first link": {
        "frame": {"O": [0, 0], "G": [150, 10]},
        "links": {
            "crank": CRANK, "rocker": {"G": 0, "F": [40, 60]}, "coupler": {"A": 0, "P": [100, 20], "S": [80, 70]},
            "bar": {"S": 0, "F": 102},
        },
        "slots": {"guide": {"pin": "P", "link": "rocker", "along": [[3, 2], [4, 2]]}},
        "sketch": {"crank_angle": 0, "P": [107, 37], "S": [79, 83], "F": [84, -19]},
    },
    "a slot of the driver": {
        "range": [-20, 20], "frame": {"O": [0, 0], "E": [120, -28], "H": [136, 79.6]},
        "links": {
            "crank": CRANK, "foot": {"E": 0, "C": 60}, "plate": {"C": 0, "D": [50, 10], "S": [90, -20]},
            "bar": {"S": 0, "H": 60.8},
        },
        "slots": {"rail": {"pin": "D", "link": "crank", "along": ["O", [30, 1]]}},
        "sketch": {"crank_angle": 0, "C": [63.7, -48.3], "D": [80, 0], "S": [126, 19.6]},
    },
    "two slots from the hinge": {  # their assemblies have the same angle of the coupler
        "frame": {"O": [0, 0], "G": [-98.5, -97.7]},
        "links": {"crank": CRANK, "coupler": {"A": 0, "C": [-31.9, 6]}, "vee": {"C": 0, "D": [-37, -124.1]}},
        "slots": {
            "up": {"pin": "O", "link": "vee", "along": ["C", [-26.3, 14.5]]},
            "down": {"pin": "G", "link": "vee", "along": ["C", [-12.2, -27.4]]},
        },
        "sketch": {"crank_angle": 0, "C": [14.9, -31.2], "D": [-87.4, -110.6]},
    },
    "a slot about a pin of the frame": {
        "frame": {"O": [0, 0], "G": [120, 60], "H": [84, -44]},
        "links": {
            "crank": CRANK, "hanger": {"A": 0, "C": 50}, "arm": {"C": 0, "S": [60, -30]}, "bar": {"S": 0, "H": 70.7},
        },
        "slots": {"eye": {"pin": "G", "link": "arm", "along": ["C", [9, 0.5]]}},
        "sketch": {"crank_angle": 0, "C": [12, 50], "S": [74.4, 25.6]},
    },
}  # fmt: skip

#: The tables, with the sketched crank as a parameter.
GROUPED = {name: {"driver": "crank", "parameters": {"r": {"default": 6.0}}} | table for name, table in _GROUPED.items()}
#: Largest step of an angle, rad, that leads to the same assembly.
_LARGEST_STEP = 0.05


class Poses:
    """The places, complex, mm, and angles, rad, of all links of a table with numbers and one parameter, r."""

    def __init__(self, table, r):
        number = lambda value: r if value == "r" else value  # noqa: E731
        place = lambda value: complex(*value) if isinstance(value, list) else complex(number(value))  # noqa: E731
        self.bodies = {"frame": table["frame"], **table["links"]}
        self.bodies = {
            body: {point: place(each) for point, each in points.items()} for body, points in self.bodies.items()
        }
        owners = {}
        for body, points in self.bodies.items():
            for point in points:
                owners.setdefault(point, []).append(body)
        self.owners, self.moving = owners, list(table["links"])
        self.pins = [(point, first, other) for point, (first, *others) in owners.items() for other in others]
        self.slots = []
        for slot in table["slots"].values():
            start, end = (
                self.bodies[slot["link"]][each] if isinstance(each, str) else place(each) for each in slot["along"]
            )
            self.slots.append((slot["pin"], slot["link"], start, (end - start) / abs(end - start)))

    def _terms(self, q, body, local):
        """A place, and its derivatives by the coordinates of the links."""
        slopes = np.zeros(3 * len(self.moving), dtype=complex)
        if body == "frame":
            return local, slopes
        k = 3 * self.moving.index(body)
        turned = np.exp(1j * q[k + 2]) * local
        slopes[k : k + 3] = 1.0, 1j, 1j * turned
        return q[k] + 1j * q[k + 1] + turned, slopes

    def solve(self, q, theta):
        """Coordinates at a crank angle by Newton's method, and the sign of its determinant; None where it fails."""
        for _ in range(30):
            gaps, slopes = [q[2] - theta], [np.eye(len(q))[2]]
            for point, first, other in self.pins:
                (a, da), (b, db) = (self._terms(q, body, self.bodies[body][point]) for body in (first, other))
                gaps += [(b - a).real, (b - a).imag]
                slopes += [(db - da).real, (db - da).imag]
            for pin, body, start, along in self.slots:
                (a, da), owner = self._terms(q, body, start), self.owners[pin][0]
                (b, db), (d, dd) = self._terms(q, owner, self.bodies[owner][pin]), self._terms(q, body, start + along)
                gaps.append((np.conj(d - a) * (b - a)).imag)
                slopes.append((np.conj(dd - da) * (b - a) + np.conj(d - a) * (db - da)).imag)
            change = np.linalg.solve(np.array(slopes), np.array(gaps))
            q = q - change
            if np.abs(change).max() < 1e-11:
                return q, np.linalg.slogdet(np.array(slopes))[0]
        return None

    def start(self, row):
        """Coordinates, and the sign, at crank angle 0 about a row of a motion."""
        q = []
        for body in self.moving:
            (one, a), (two, b) = list(self.bodies[body].items())[:2]
            known = [
                self.bodies["frame"][each] if each in self.bodies["frame"] else row[f"{each}_x"] + 1j * row[f"{each}_y"]
                for each in (one, two)
            ]
            turn = (known[1] - known[0]) / (b - a)
            origin = known[0] - turn / abs(turn) * a
            q += [origin.real, origin.imag, np.angle(turn)]
        return self.solve(np.array(q), 0.0)

    def follow(self, start, sense, steps):
        """Coordinates after each of so many steps of a turn, up to the last one before two assemblies meet."""
        path, state = [start[0]], start
        for k in range(steps):
            state = self._advance(state, *(sense * 2 * np.pi * each / steps for each in (k, k + 1)))
            if state is None:
                break
            path.append(state[0])
        return np.array(path)

    def _advance(self, state, start, end, halvings=6):
        """The state at the end of a step, which is halved where it may lead to another assembly; None where it does."""
        ahead = self.solve(state[0], end)
        if ahead and ahead[1] == state[1] and np.abs(ahead[0] - state[0])[2::3].max() < _LARGEST_STEP:
            return ahead
        middle = self._advance(state, start, 0.5 * (start + end), halvings - 1) if halvings else None
        return middle and self._advance(middle, 0.5 * (start + end), end, halvings - 1)
