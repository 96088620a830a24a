"""Linkages of one to six dyads of all kinds that Hypothesis draws, each assembled at a crank angle."""

import cmath
import math

from hypothesis import assume
from hypothesis import strategies as st

#: Least sine or cosine of an angle that decides between two assemblies: rounding is within a few digits there.
_LEAST = 0.1
_PLACES = st.tuples(st.integers(-150, 150), st.integers(-150, 150))
_DIRECTIONS = st.integers(-179, 180)


class Chain:
    """A linkage that grows by dyads.

    `poses` are the origin and the direction of each body at the crank angle, deg; `values` those of the parameters.
    """

    def __init__(self, draw):
        self._draw, self.angle = draw, draw(st.integers(0, 359))
        self.poses = {"frame": (0j, 1 + 0j), "crank": (0j, self._direction(self.angle))}
        self.values = {"r": 30.0}
        self._points, self._owners, self._count = {"O": 0j}, {"O": {"frame", "crank"}}, 0
        self.table = {
            "driver": "crank", "frame": {"O": [0, 0]}, "links": {"crank": {"O": 0}}, "slots": {}, "slides": {},
            "branch": {},
        }  # fmt: skip
        self._add("crank", "A", 30.0 * self.poses["crank"][1], "r")

    @staticmethod
    def _direction(degrees):
        return cmath.rect(1.0, math.radians(degrees))

    def _add(self, body, point, place, local=None):
        """Give a body a point, at what its pose says, or at `local`; a number of a frame, now and then, has a name."""
        if local is None:
            origin, direction = self.poses[body]
            inner = (place - origin) / direction
            local = [inner.real, inner.imag]
            if self._draw(st.booleans()):
                self.values[f"{point}_{body}"], local[0] = local[0], f"{point}_{body}"
        (self.table["frame"] if body == "frame" else self.table["links"].setdefault(body, {}))[point] = local
        self._points[point] = place
        self._owners.setdefault(point, set()).add(body)

    def _link(self, place, direction, origin=None):
        """A new link; it is where a place is at a drawn place of its own, or about a given origin."""
        link = f"link{len(self.poses)}"
        if origin is None:
            origin = place - direction * complex(*self._draw(_PLACES))
        self.poses[link] = origin, direction
        # another point, which shows how the link turns, and which later dyads may hang on
        self._add(link, f"P{len(self.poses)}", origin + direction * complex(*self._draw(_PLACES)))
        return link

    def _known(self, *, new=False):
        """A point; or a new one of the frame."""
        point = self._draw(st.sampled_from([*self._points, "new"] if new else [*self._points]))
        return self._new() if point == "new" else (point, self._points[point])

    def _new(self):
        """A new point of the frame."""
        point = f"G{self._count}"
        self._add("frame", point, complex(*self._draw(_PLACES)))
        return point, self._points[point]

    def _body(self, known, without):
        """One of the known bodies that is none of some others."""
        bodies = [body for body in known if body not in without]
        assume(bodies)
        return self._draw(st.sampled_from(bodies))

    def _line(self, place, body):
        """A direction at the crank angle, and two places of a line of a body, in its own coordinates, that passes one.

        One of them may be beyond the place.
        """
        along, (origin, turn) = self._direction(self._draw(_DIRECTIONS)), self.poses[body]
        ends = [(place + along * distance - origin) / turn for distance in (-self._draw(st.integers(20, 200)), 30)]
        return along, [[end.real, end.imag] for end in ends]

    def grow(self):
        """Add a dyad of a kind that is drawn."""
        kinds = self._bars, self._guide, self._lever, self._block, self._crossing, self._hanging
        self._count += 1
        self._draw(st.sampled_from(kinds))(f"J{self._count}", f"slot{self._count}", list(self.poses))

    def uses_crank(self):
        """Whether anything hangs on the crank but its pivot, as a table has to have it."""
        slots, slides = self.table["slots"].values(), self.table["slides"].values()
        pins = {slot["pin"] for slot in slots}
        moved = [point for point in self.table["links"]["crank"] if point != "O"]
        return any(len(self._owners[point]) > 1 or point in pins for point in moved) or "crank" in [
            part["link"] for part in (*slots, *slides)
        ]

    def _reach(self, centre):
        """A place for a new joint that is not too near to the centre of a circle."""
        place = complex(*self._draw(_PLACES))
        assume(abs(place - centre) >= 20.0)
        return place

    def _bar(self, centre_point, centre, joint, place):
        """A link with a known point and a new joint; now and then a plate whose origin is neither."""
        if self._draw(st.booleans()):
            link = self._link(place, self._direction(self._draw(_DIRECTIONS)))
            self._add(link, centre_point, centre)
            self._add(link, joint, place)
        else:
            link = self._link(place, (place - centre) / abs(place - centre), centre)
            self._add(link, centre_point, centre, 0)
            self.values[f"l_{link}"] = abs(place - centre)
            self._add(link, joint, place, f"l_{link}")

    def _bars(self, joint, _slot, _known):
        """RRR."""
        if self._draw(st.booleans()):
            (one, f), (other, g) = self._known(), self._known(new=True)
        else:
            (one, f), (other, g) = ("A", self._points["A"]), self._new()
        assume(abs(f - g) >= 20.0)
        place = self._reach(f)
        assume(abs(place - g) >= 20.0)
        side = ((g - f).conjugate() * (place - f)).imag
        sine = ((g - place).conjugate() * (place - f)).imag / abs(g - place) / abs(place - f)
        assume(abs(sine) >= _LEAST)
        self._bar(one, f, joint, place)
        self._bar(other, g, joint, place)
        self.table["branch"][joint] = f"{'left' if side > 0 else 'right'} of {one} {other}"

    def _set_side(self, joint, centre, place, along):
        cosine = ((place - centre).conjugate() * along).real / abs(place - centre)
        assume(abs(cosine) >= _LEAST)
        self.table["branch"][joint] = "far" if cosine > 0 else "near"

    def _guide(self, joint, slot, known):
        """RRP: a pin in a slot of a known body."""
        point, centre = self._known()
        place, body = self._reach(centre), self._body(known, self._owners[point])
        along, ends = self._line(place, body)
        self._set_side(joint, centre, place, along)
        self._bar(point, centre, joint, place)
        self.table["slots"][slot] = {"pin": joint, "link": body, "along": ends}

    def _block(self, joint, _slot, known):
        """RRP: a link that slides along a known body."""
        point, centre = self._known()
        place, body = self._reach(centre), self._body(known, self._owners[point])
        along, block = self._sliding(body, place)
        self._set_side(joint, centre, place, along)
        self._bar(point, centre, joint, place)
        self._add(block, joint, place)

    def _sliding(self, body, place):
        """A new link that slides along a body and has a place, and its direction of now."""
        along, turn = self._direction(self._draw(_DIRECTIONS)), self.poses[body][1]
        inner = along / turn
        origin = self.poses[body][0] + along * self._draw(st.integers(-100, 100))
        link = self._link(place, turn, origin)
        self.table["slides"][link] = {"link": body, "direction": [inner.real, inner.imag]}
        return along, link

    def _lever(self, _joint, slot, _known):
        """RPR: a known pin in the slot of a link that turns about a known point."""
        (pin, f), (pivot, g) = self._known(), self._known(new=True)
        assume(abs(f - g) >= 20.0)
        link = self._link(g, self._direction(self._draw(_DIRECTIONS)))
        self._add(link, pivot, g)
        if self._draw(st.booleans()):  # a slot through the pivot
            along = (f - g) / abs(f - g) * self._draw(st.sampled_from([1, -1]))
            beyond = (g + 30.0 * along - self.poses[link][0]) / self.poses[link][1]
            ends = [pivot, [beyond.real, beyond.imag]]
        else:
            along, ends = self._line(f, link)
        cosine = ((f - g).conjugate() * along).real / abs(f - g)
        assume(abs(cosine) >= _LEAST)
        self.table["slots"][slot] = {"pin": pin, "link": link, "along": ends}
        self.table["branch"][slot] = "positive" if cosine > 0 else "negative"

    def _crossing(self, joint, slot, known):
        """PRP: a joint of a link that slides along a body and of a slot or a sliding link of another one."""
        body = self._body(known, ())
        other, place = self._body(known, {body}), complex(*self._draw(_PLACES))
        along, link = self._sliding(body, place)
        self._add(link, joint, place)
        if self._draw(st.booleans()):
            across, second = self._sliding(other, place)
            self._add(second, joint, place)
        else:
            across, ends = self._line(place, other)
            self.table["slots"][slot] = {"pin": joint, "link": other, "along": ends}
        assume(abs((along.conjugate() * across).imag) >= _LEAST)

    def _hanging(self, joint, slot, known):
        """RPP: a known pin in the slot of a link that slides along a body."""
        pin, place = self._known()
        along, link = self._sliding(self._body(known, self._owners[pin]), place)
        self._add(link, joint, place + self.poses[link][1] * complex(*self._draw(_PLACES)))
        across, ends = self._line(place, link)
        assume(abs((along.conjugate() * across).imag) >= _LEAST)
        self.table["slots"][slot] = {"pin": pin, "link": link, "along": ends}


@st.composite
def chains(draw):
    """A chain of one to six dyads on a crank."""
    chain = Chain(draw)
    for _ in range(draw(st.integers(1, 6))):
        chain.grow()
    assume(chain.uses_crank())
    return chain
