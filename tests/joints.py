"""All joints of a linkage together, as equations that know no dyads, and their solution by Newton's method."""

import mpmath
import numpy as np
from mpmath import mpf

#: Step of differences, rad or mm: its square is the error of central ones.
STEP = mpf(10) ** -12


class Joints:
    """All joints of a linkage of links with pins, slots and slides; `q` are x, y, mm, and angle, rad, of each link."""

    def __init__(self, table, values):
        self.values = {key: mpf(value) for key, value in values.items()}
        self.links = {link: self.places(points) for link, points in table["links"].items()}
        self.bodies = {"frame": self.places(table["frame"]), **self.links}
        self.driver, self.slots = 3 * list(self.links).index(table["driver"]) + 2, {}
        for name, slot in table.get("slots", {}).items():
            body = slot.get("link", "frame")
            ends = [self.bodies[body][end] if isinstance(end, str) else self.place(end) for end in slot["along"]]
            self.slots[name] = slot["pin"], body, ends
        self.slides = {
            link: (slide["link"], self.place(slide["direction"])) for link, slide in table.get("slides", {}).items()
        }
        owners = {
            point: [b for b in self.bodies if point in self.bodies[b]] for b in self.bodies for point in self.bodies[b]
        }
        self.owners = owners
        self.pins = [(point, first, other) for point, (first, *others) in owners.items() for other in others]

    def number(self, value):
        return mpf(eval(value, {"sqrt": mpmath.sqrt}, self.values)) if isinstance(value, str) else mpf(value)

    def place(self, value):
        x, y = value if isinstance(value, list) else (value, 0)
        return self.number(x), self.number(y)

    def places(self, points):
        return {point: self.place(value) for point, value in points.items()}

    def angle(self, q, link):
        return mpf(0) if link == "frame" else q[3 * list(self.links).index(link) + 2]

    def at(self, q, body, place):
        if body == "frame":
            return place
        k = 3 * list(self.links).index(body)
        turn = mpmath.expj(q[k + 2]) * mpmath.mpc(*place) + mpmath.mpc(q[k], q[k + 1])
        return turn.real, turn.imag

    def point(self, q, point):
        body = self.owners[point][0]
        return self.at(q, body, self.bodies[body][point])

    def along_and_across(self, q, name):
        """The position of the pin along a slot from its first point, and to the left of it."""
        pin, body, ends = self.slots[name]
        (ax, ay), (bx, by), (x, y) = *(self.at(q, body, end) for end in ends), self.point(q, pin)
        length = mpmath.hypot(bx - ax, by - ay)
        nx, ny = (bx - ax) / length, (by - ay) / length
        return nx * (x - ax) + ny * (y - ay), nx * (y - ay) - ny * (x - ax)

    def turn_and_departure(self, q, link):
        """What a link that only translates has turned, rad, and how far its origin is from its line."""
        body, direction = self.slides[link]
        (ax, ay), (bx, by), (x, y) = *(self.at(q, body, each) for each in ((0, 0), direction)), self.at(q, link, (0, 0))
        departure = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        turn = mpmath.arg(mpmath.expj(self.angle(q, link) - self.angle(q, body)))
        return turn, departure / mpmath.hypot(*direction)

    def slid(self, q, link):
        """The place of the origin of a link that only translates along its direction."""
        body, direction = self.slides[link]
        (ax, ay), (bx, by), (x, y) = *(self.at(q, body, each) for each in ((0, 0), direction)), self.at(q, link, (0, 0))
        return ((bx - ax) * (x - ax) + (by - ay) * (y - ay)) / mpmath.hypot(*direction)

    def equations(self, q, theta):
        gaps = []
        for point, first, other in self.pins:
            a, b = self.at(q, first, self.bodies[first][point]), self.at(q, other, self.bodies[other][point])
            gaps += [b[0] - a[0], b[1] - a[1]]
        gaps += [self.along_and_across(q, name)[1] for name in self.slots]
        gaps += [gap for link in self.slides for gap in self.turn_and_departure(q, link)]
        return [*gaps, q[self.driver] - theta]

    def start(self, row, theta):
        """About the place of each link, from two of its points in a row of a motion."""
        q = []
        for points in self.links.values():
            (one, a), (two, b) = list(points.items())[:2]
            known = [
                mpmath.mpc(*self.bodies["frame"][p]) if p in self.bodies["frame"]
                else mpmath.mpc(float(row[f"{p}_x"]), float(row[f"{p}_y"])) for p in (one, two)
            ]  # fmt: skip
            turn = (known[1] - known[0]) / (mpmath.mpc(*b) - mpmath.mpc(*a))
            origin = known[0] - turn / abs(turn) * mpmath.mpc(*a)
            q += [origin.real, origin.imag, mpmath.arg(turn)]
        q[self.driver] = theta
        return q

    def solve(self, q, theta):
        """Places to all digits about known ones of doubles: slopes of those, in doubles, gain a dozen digits a step."""
        slopes = np.array(jacobian(lambda z: self.equations(z, theta), q).tolist(), dtype=float)
        for _ in range(12):
            change = np.linalg.solve(slopes, [float(gap) for gap in self.equations(q, theta)])
            q = [x - mpf(d) for x, d in zip(q, change, strict=True)]
            if np.abs(change).max() < 10.0 ** (10 - mpmath.mp.dps):  # that of the next step is at the rounding
                return q
        raise AssertionError("Newton's iteration does not converge")


def jacobian(function, q):
    """Slopes by all coordinates, from central differences."""
    columns = []
    for k in range(len(q)):
        ahead, behind = ([x + side * STEP if i == k else x for i, x in enumerate(q)] for side in (1, -1))
        columns.append([(a - b) / (2 * STEP) for a, b in zip(function(ahead), function(behind), strict=True)])
    return mpmath.matrix(columns).T
