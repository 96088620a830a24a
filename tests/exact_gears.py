"""Statistics of a gear pair and of its trains over intervals: of one in 40 digits, of several in double precision.

The law is that of `gear_pair`; pitch curves are polar curves from the radii alone, and all rates are by mpmath. Pieces
end where the law changes, of a train also where that of its second pair does, of several trains also where another one
becomes the fastest.
"""

from functools import cached_property
from itertools import pairwise

import mpmath as mp
import numpy as np
from exact_slider_crank import gauss_legendre
from gear_pair import GearPair
from numpy.polynomial.legendre import leggauss

DIGITS = 40
_NODES = 20
#: Largest difference of an integral and that of its halves, relative to the integral of the squares or its root.
_AGREED = mp.mpf(10) ** -20
#: Parts of a piece among which extremes are looked for.
_GRID = 32
#: Ends of pieces that are one.
_EQUAL = mp.mpf(10) ** -30
_TURN = 2.0 * np.pi
_SMOOTHSTEPS = {
    1: lambda x: 3 * x**2 - 2 * x**3,
    2: lambda x: 10 * x**3 - 15 * x**4 + 6 * x**5,
    3: lambda x: 35 * x**4 - 84 * x**5 + 70 * x**6 - 20 * x**7,
}


def _gauss(function, start, stop):
    half, centre = (stop - start) / 2, (stop + start) / 2
    values = [(half * weight, function(centre + half * x)) for x, weight in gauss_legendre(mp.mp.prec)]
    return sum(w * v for w, v in values), sum(w * v * v for w, v in values)


def _moments(function, start, stop, whole=None, depth=12):
    """Integrals of a function and of its square: halves of halves until they agree with the whole."""
    whole = whole or _gauss(function, start, stop)
    middle = (start + stop) / 2
    halves = [_gauss(function, start, middle), _gauss(function, middle, stop)]
    total = [sum(parts) for parts in zip(*halves, strict=True)]
    room = _AGREED * total[1]
    size = mp.sqrt(total[1] * (stop - start))
    if not depth or (abs(total[1] - whole[1]) <= room and abs(total[0] - whole[0]) <= _AGREED * size):
        return total
    parts = [
        _moments(function, *ends, half, depth - 1)
        for ends, half in zip(((start, middle), (middle, stop)), halves, strict=True)
    ]
    return [sum(each) for each in zip(*parts, strict=True)]


def _lowest(function, start, stop):
    """The smallest value between two places: the best of a grid, refined by thirds."""
    places = [start + (stop - start) * k / _GRID for k in range(_GRID + 1)]
    values = [function(place) for place in places]
    best = min(range(_GRID + 1), key=values.__getitem__)
    low, high = places[max(best - 1, 0)], places[min(best + 1, _GRID)]
    for _ in range(60):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        low, high = (low, right) if function(left) <= function(right) else (left, high)
    return min(values[best], function((low + high) / 2))


class ExactGears(GearPair):
    """A pair and one train, by the names of the design's parameters; angles in rad."""

    def __init__(self, design, start=()):
        super().__init__(design["growth"], design["sector"], int(design["return_order"]), start)
        self.distance, self.shift = mp.mpf(design["centre_distance"]), mp.mpf(design["phase_shift"])
        self.trains, self.turn = int(design["trains"]), 2 * mp.pi

    def statistics(self, name, start, stop):
        """Mean, mean square, smallest and largest value of a signal between two angles, in units of the package."""
        totals, lowest, highest = [mp.mpf(0), mp.mpf(0)], mp.inf, -mp.inf
        for low, high in pairwise(self._ends(name, start, stop)):
            is_return = self._folded((low + high) / 2) > self.sector
            base = self.turn * mp.floor((low + high) / (2 * self.turn))

            def signal(angle, base=base, is_return=is_return):
                return getattr(self, f"_{name}")(angle - base, is_return)

            totals = [sum(pair) for pair in zip(totals, _moments(signal, low, high), strict=True)]
            lowest = min(lowest, _lowest(signal, low, high))
            highest = max(highest, -_lowest(lambda angle, f=signal: -f(angle), low, high))
        return totals[0] / (stop - start), totals[1] / (stop - start), lowest, highest

    def _ends(self, name, start, stop):
        """Ends of pieces in which a signal is smooth."""
        breaks = [mp.mpf(0), self.sector]
        if name == "train_ratio":
            breaks += [self._folded(place - self.shift) for place in breaks]
        turns = range(int(mp.floor(start / self.turn)) - 1, int(mp.ceil(stop / self.turn)) + 1)
        inside = [place + k * self.turn for place in breaks for k in turns]
        ends = sorted([start, stop, *(place for place in inside if start < place < stop)])
        return [one for one, other in pairwise(ends) if other - one > _EQUAL] + [stop]

    def _folded(self, angle):
        return angle - self.turn * mp.floor(angle / self.turn)

    def _ratio(self, angle, is_return):
        return self.ratio(angle, is_return)

    def _ratio_rate(self, angle, is_return):
        return mp.diff(lambda x: self.ratio(x, is_return), angle)

    def _ratio_acceleration(self, angle, is_return):
        return mp.diff(lambda x: self.ratio(x, is_return), angle, 2)

    def _speed_ratio(self, angle, is_return):
        return 1 / self.ratio(angle, is_return)

    def _speed_ratio_rate(self, angle, is_return):
        return mp.diff(lambda x: self._speed_ratio(x, is_return), angle)

    def _driver_radius(self, angle, is_return):
        return self.distance / (1 + self.ratio(angle, is_return))

    def _driven_radius(self, angle, is_return):
        return self.distance - self._driver_radius(angle, is_return)

    def _pitch_tilt(self, angle, is_return):
        radius = lambda x: self._driver_radius(x, is_return)  # noqa: E731
        return mp.degrees(mp.atan(-mp.diff(radius, angle) / radius(angle)))

    def _pitch_length(self, angle, is_return):
        return abs(mp.diff(lambda x: self._driver_radius(x, is_return) * mp.expj(x), angle))

    def _driver_curvature(self, angle, is_return):
        first, second = (mp.diff(lambda x: self._driver_radius(x, is_return) * mp.expj(x), angle, n) for n in (1, 2))
        return (mp.conj(first) * second).imag / abs(first) ** 3

    def _driven_curvature(self, angle, is_return):
        radius, slope, bend = (mp.diff(lambda x: self._driven_radius(x, is_return), angle, n) for n in range(3))
        turning, spinning = (mp.diff(lambda x: self._speed_ratio(x, is_return), angle, n) for n in range(2))
        first = mp.mpc(slope, radius * turning)
        second = mp.mpc(bend - radius * turning**2, 2 * slope * turning + radius * spinning)
        return (mp.conj(first) * second).imag / abs(first) ** 3

    def _driven_angle(self, angle, _is_return):
        return mp.degrees(self.driven_angle(angle))

    def _train_ratio(self, angle, _is_return=None):
        return self.ratio(angle) / self.ratio(self._folded(angle + self.shift))

    @cached_property
    def _knots(self):
        """Angles of the return and the driven angles there, which the integral of 1/i goes on from."""
        places = mp.linspace(self.sector, self.turn, 65)
        driven = [self.constant * mp.expm1(self.log_growth * self.sector)]
        for ends in pairwise(places):
            driven.append(driven[-1] + self._integral(*ends))
        return places, driven

    def _integral(self, start, stop):
        return _gauss(lambda x: 1 / self.ratio(x, True), start, stop)[0]

    def driven_angle(self, angle):
        """The angle of gear 2, rad."""
        if angle <= self.sector:
            return self.constant * mp.expm1(self.log_growth * angle)
        places, driven = self._knots
        k = min(int((angle - self.sector) / (places[1] - places[0])), 63)
        return driven[k] + self._integral(places[k], angle)


class Drive:
    """All trains behind their clutches, from the law of an exact pair: arrays of doubles, good to 1e-14."""

    def __init__(self, pair):
        self.pair, self.sector, self.shift, self.trains = pair, float(pair.sector), float(pair.shift), pair.trains
        self.log_growth, self.constant, self.start = (float(x) for x in (pair.log_growth, pair.constant, pair.start))
        self.sine = [float(x) for x in pair.sine]
        self.knots = np.linspace(self.sector, _TURN, 257)
        parts = self._integral(self.knots[:-1], self.knots[1:])
        self.driven = self.constant * np.expm1(self.log_growth * self.sector) + np.append(0.0, np.cumsum(parts))

    def statistics(self, start, stop):
        """Mean, mean square, smallest and largest overall ratio between two angles, rad."""
        ends = self._ends(start, stop)
        nodes, weights = leggauss(_NODES)
        totals, extremes = np.zeros(2), []
        for low, high in pairwise(ends):
            edges = np.linspace(low, high, 65)
            half = 0.5 * (edges[1] - edges[0])
            values = self.overall((edges[:-1, None] + half * (1.0 + nodes)).ravel()).reshape(64, -1)
            totals += half * np.array([(values @ weights).sum(), (values**2 @ weights).sum()])
            extremes += [sign * self._lowest(sign, low, high) for sign in (1.0, -1.0)]
        return (*totals / (stop - start), min(extremes), max(extremes))

    def overall(self, angles):
        """The ratio of the fastest train."""
        return self._trains(angles).max(axis=0)

    def _ratio(self, angle):
        angle = angle % _TURN
        working = self.start * np.exp(-self.log_growth * angle)
        s = np.maximum(angle - self.sector, 0.0)
        if self.pair.order:
            share = s / (_TURN - self.sector)
            step = _SMOOTHSTEPS[self.pair.order](share)
            returning = self.start * np.exp(self.log_growth * (_TURN * step - self.sector - s))
        else:
            amplitude, frequency, phase, mean = self.sine
            returning = amplitude * np.sin(frequency * s + phase) + mean
        return np.where(angle > self.sector, returning, working)

    def _integral(self, start, stop):
        nodes, weights = leggauss(_NODES)
        half = 0.5 * (stop - start)
        return half * (1.0 / self._ratio(start[:, None] + half[:, None] * (1.0 + nodes)) @ weights)

    def _driven_angle(self, angle):
        k = np.clip(np.searchsorted(self.knots, angle, "right") - 1, 0, len(self.knots) - 2)
        returning = self.driven[k] + self._integral(self.knots[k], np.maximum(angle, self.sector))
        return np.where(angle > self.sector, returning, self.constant * np.expm1(self.log_growth * angle))

    def _driver_angle(self, driven):
        angle = np.interp(driven, self.driven, self.knots)
        for _ in range(5):
            angle = np.clip(angle - (self._driven_angle(angle) - driven) * self._ratio(angle), self.sector, _TURN)
        working = np.log1p(np.minimum(driven, self.driven[0]) / self.constant) / self.log_growth
        return np.where(driven > self.driven[0], angle, working)

    def _of_train(self, angles, train):
        """Angles of gear 1 of another train, whose input is ahead by its share of the turn."""
        return self._driver_angle((self._driven_angle(angles % _TURN) + train * _TURN / self.trains) % _TURN)

    def _trains(self, angles):
        own = [angles, *(self._of_train(angles, train) for train in range(1, self.trains))]
        return np.array([self._ratio(angle) / self._ratio(angle + self.shift) for angle in own])

    def _ends(self, start, stop):
        """Ends of pieces in which one train is the fastest and no law changes."""
        places = np.array([0.0, self.sector, -self.shift, self.sector - self.shift]) % _TURN
        laws = np.concatenate([self._of_train(places, train) for train in range(self.trains)])
        inside = (laws + _TURN * np.arange(-3, 4)[:, None]).ravel()
        ends = np.unique([start, stop, *inside[(inside > start) & (inside < stop)]])
        fine = np.concatenate([np.linspace(*pair, 66)[1:-1] for pair in pairwise(ends)])
        first = self._fastest(fine)
        changed = np.flatnonzero(first[1:] != first[:-1])
        low, high, before = fine[changed], fine[changed + 1], first[changed]
        for _ in range(60 if len(changed) else 0):
            middle = 0.5 * (low + high)
            same = self._fastest(middle) == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        ends = np.unique([*ends, *low])
        return ends[np.append(np.diff(ends) > 1e-13, True)]

    def _fastest(self, angles):
        ratios = self._trains(angles)
        return np.argmax(ratios > ratios.max(axis=0) * (1.0 - 1e-13), axis=0)

    def _lowest(self, sign, low, high):
        """The smallest value of the signal times a sign between two places: grids within grids."""
        least = np.inf
        for _ in range(12):
            places = np.linspace(low, high, _GRID + 1)
            values = sign * self.overall(places)
            best = int(np.argmin(values))
            least = min(least, values[best])
            low, high = places[max(best - 1, 0)], places[min(best + 1, _GRID)]
        return least
