"""Peers of `requests`: the same statistics by NumPy, JAX and Numba, from textbook formulas at crank angles.

Signals are functions of parameters p, an index j of designs, and cosines and sines of the crank angle. In NumPy and JAX
p has the shape (parameters, designs, 1) and j is all of them; in a loop of Numba's j is one design.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np

#: Number of samples that leave no error of a moment but rounding.
MANY = 256
#: Number of samples that tell a highest peak from one nearly as high.
MANY_FOR_PEAKS = 4096
#: Designs of a block of NumPy whose arrays stay in the cache: the fastest power of two from 64 to 4096.
NUMPY_BLOCK = 512
#: Designs of a block of JAX: the fastest power of two from 256 to 16,384.
JAX_BLOCK = 2048
#: Designs that a loop of Numba computes at once.
LANES = 16
#: Numba's options; what is not finite stays visible, as in `explore`.
OPTIONS = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy"}


@dataclass(frozen=True)
class Peer:
    """The question of a request: signals by a function of `sqrt`, their number, and a statistic of them.

    "moments" are means, then variances; "rms" takes squares; "peak" is the largest magnitude of one signal.
    """

    signals: Callable
    count: int
    statistic: str
    is_stroke: bool = False

    def error(self, values, exact):
        """Largest relative error; that of a mean is relative to the root mean square.

        Of peaks it is that of 999 designs in 1,000: samples may take the lower of two peaks of nearly the same height.
        """
        if self.statistic == "peak":
            return np.quantile(np.abs(values / exact - 1.0), 0.999)
        if self.statistic == "rms":
            return (np.abs(values - exact) / np.abs(exact)).max()
        n = self.count
        errors = np.abs(values - exact) / np.concatenate([np.sqrt(exact[:n] ** 2 + exact[n:]), exact[n:]])
        return errors.max()

    def finish(self, xp, means, squares):
        """Statistics from means of the signals and of their squares."""
        return xp.sqrt(means) if self.statistic == "rms" else xp.concatenate([means, squares - means * means])


def _alone(function):
    """A function of arrays as it is; Numba inlines it."""
    return function


def four_bar(sqrt):
    """Rates of coupler and rocker for unit speed, the vectors of crank and coupler, 1 over r2 r3 sin(transmission)."""

    def signals(p, j, c, s):
        r1, r2, r3, r4 = p[0, j], p[1, j], p[2, j], p[3, j]
        bx, by = r1 * c, r1 * s
        dx, dy = r4 - bx, -by
        d2 = dx * dx + dy * dy
        difference, total = r2 - r3, r2 + r3
        area = 0.5 * sqrt((d2 - difference * difference) * (total * total - d2))
        one_over_d2, one_over_area = 1.0 / d2, 1.0 / area
        k, m = 0.5 + 0.5 * difference * total * one_over_d2, area * one_over_d2
        ux, uy = k * dx - m * dy, k * dy + m * dx
        vx, vy = ux - dx, uy - dy
        w3, w2 = (ux * by - uy * bx) * one_over_area, (vx * by - vy * bx) * one_over_area
        square2, square3 = w2 * w2, w3 * w3
        px, py = square3 * vx - square2 * ux - bx, square3 * vy - square2 * uy - by
        a2, a3 = -(px * vx + py * vy) * one_over_area, -(px * ux + py * uy) * one_over_area
        return w2, w3, a2, a3, bx, by, ux, uy, one_over_area

    return signals


def rates(sqrt, inline):
    """Velocities and accelerations of coupler and rocker."""
    motion = inline(four_bar(sqrt))
    return lambda p, j, c, s: motion(p, j, c, s)[:4]


def force(sqrt, inline):
    """Force along the coupler, N: an inertia and a constant torque on the rocker."""
    motion = inline(four_bar(sqrt))

    def signals(p, j, c, s):
        _, _, _, a3, _, _, _, _, one_over_area = motion(p, j, c, s)
        return (1e3 * (p[5, j] * a3 * p[6, j] * p[6, j] - p[4, j]) * p[1, j] * one_over_area,)

    return signals


def points(sqrt, inline):
    """Squares of the velocities of four points of the coupler."""
    motion = inline(four_bar(sqrt))

    def signals(p, j, c, s):
        w2, _, _, _, bx, by, ux, uy, _ = motion(p, j, c, s)
        k = w2 / p[1, j]
        x1, y1 = -by - k * (p[4, j] * uy + p[5, j] * ux), bx + k * (p[4, j] * ux - p[5, j] * uy)
        x2, y2 = -by - k * (p[6, j] * uy + p[7, j] * ux), bx + k * (p[6, j] * ux - p[7, j] * uy)
        x3, y3 = -by - k * (p[8, j] * uy + p[9, j] * ux), bx + k * (p[8, j] * ux - p[9, j] * uy)
        x4, y4 = -by - k * (p[10, j] * uy + p[11, j] * ux), bx + k * (p[10, j] * ux - p[11, j] * uy)
        return x1 * x1 + y1 * y1, x2 * x2 + y2 * y2, x3 * x3 + y3 * y3, x4 * x4 + y4 * y4

    return signals


def torque(sqrt, inline):  # noqa: ARG001  (one function)
    """Square of the torque that turns the crank of a slider-crank, (N m)^2: a mass and a force on the slider."""

    def signals(p, j, c, s):
        r, rod, w = p[0, j], p[1, j], p[4, j]
        rs, rc = r * s, r * c
        along = sqrt(rod * rod - rs * rs)
        ratio = rs * rc / along
        velocity = -(rs + ratio)
        acceleration = -(rc + (rc * rc - rs * rs + ratio * ratio) / along)
        value = (1e-3 * p[2, j] * acceleration * w * w - p[3, j]) * velocity * 1e-3
        return (value * value,)

    return signals


def watt(sqrt, inline):
    """Velocity and acceleration of the output of a six-bar: two dyads, the second on the rocker of the first."""
    motion = inline(four_bar(sqrt))

    def signals(p, j, c, s):
        _, w3, _, a3, bx, by, ux, uy, _ = motion(p, j, c, s)
        r3, r5, r6 = p[2, j], p[6, j], p[7, j]
        vx, vy = (bx + ux - p[3, j]) / r3, (by + uy) / r3  # direction of the rocker
        qx, qy = p[4, j] * vx - p[5, j] * vy, p[4, j] * vy + p[5, j] * vx
        dx, dy = p[8, j] - p[3, j] - qx, -qy
        d2 = dx * dx + dy * dy
        difference, total = r5 - r6, r5 + r6
        area = 0.5 * sqrt((d2 - difference * difference) * (total * total - d2))
        one_over_d2, one_over_area = 1.0 / d2, 1.0 / area
        k, m = 0.5 + 0.5 * difference * total * one_over_d2, area * one_over_d2
        ex, ey = k * dx - m * dy, k * dy + m * dx  # the rod
        fx, fy = ex - dx, ey - dy  # the output link
        velocity_x, velocity_y = -w3 * qy, w3 * qx
        w6 = -(ex * velocity_x + ey * velocity_y) * one_over_area
        w5 = -(fx * velocity_x + fy * velocity_y) * one_over_area
        px = w6 * w6 * fx - w5 * w5 * ex - a3 * qy - w3 * w3 * qx
        py = w6 * w6 * fy - w5 * w5 * ey + a3 * qx - w3 * w3 * qy
        return w6, -(px * ex + py * ey) * one_over_area

    return signals


MOMENTS, STROKE = Peer(rates, 4, "moments"), Peer(rates, 4, "moments", is_stroke=True)
TORQUE, FORCE = Peer(torque, 1, "rms"), Peer(force, 1, "peak")
POINTS, WATT = Peer(points, 4, "rms"), Peer(watt, 2, "moments")


def slow_stroke(xp, p):
    """First crank angle and length of the slower stroke of four-bars, between the limit positions, rad."""
    r1, r2, r3, r4 = p[0], p[1], p[2], p[3]
    extended, overlapped = (
        xp.arccos((reach * reach + r4 * r4 - r3 * r3) / (2.0 * reach * r4)) for reach in (r2 + r1, r2 - r1)
    )
    length = extended - overlapped + np.pi
    return xp.where(length > np.pi, overlapped - np.pi, extended), xp.maximum(length, 2.0 * np.pi - length)


def _rule(peer, count):
    """Fractions of the window and weights of sum 1."""
    if not peer.is_stroke:
        return np.arange(count) / count, np.full(count, 1.0 / count)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 + 0.5 * nodes, 0.5 * weights


def _peak(signals, xp, inline):
    """The magnitude of a signal at an angle, and the greatest one near it: the tops of two parabolas."""
    cos, sin, minimum, maximum = xp.cos, xp.sin, xp.minimum, xp.maximum

    @inline
    def magnitude(p, j, angle):
        return abs(signals(p, j, cos(angle), sin(angle))[0])

    @inline
    def refined(p, j, angle, step):
        for h in (step, step * step):
            before, here, after = magnitude(p, j, angle - h), magnitude(p, j, angle), magnitude(p, j, angle + h)
            angle = angle + maximum(-h, minimum(h, 0.5 * h * (before - after) / (before - 2.0 * here + after)))
        return magnitude(p, j, angle)

    return refined


def by_numpy(peer, count, parameters):
    """Statistics, shape (k, n), of parameters (p, n), in blocks."""
    signals = peer.signals(np.sqrt, _alone)
    fractions, weights = _rule(peer, count)
    angle, out = 2.0 * np.pi * fractions, []
    for start in range(0, parameters.shape[1], NUMPY_BLOCK):
        p = parameters[:, start : start + NUMPY_BLOCK, None]
        if peer.is_stroke:
            first, length = slow_stroke(np, p)
            angle = first + length * fractions
        values = signals(p, slice(None), np.cos(angle), np.sin(angle))
        if peer.statistic == "peak":
            at = angle[np.abs(values[0]).argmax(axis=1)]
            out.append(_peak(signals, np, _alone)(p[:, :, 0], slice(None), at, angle[1])[None])
        else:
            means = np.array([value @ weights for value in values])
            squares = np.array([(value * value) @ weights for value in values])
            out.append(peer.finish(np, means, squares))
    return np.concatenate(out, axis=1)


def jax_function(peer, count):
    """A compiled function of parameters (p, n) to statistics (k, n): a loop over nodes, its lanes are designs."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    signals = peer.signals(jnp.sqrt, _alone)
    fractions, weights = _rule(peer, count)
    turn = 2.0 * np.pi * fractions
    nodes = np.column_stack([np.cos(turn), np.sin(turn), fractions, weights])

    def add(p, stroke, sums, node):
        cosine, sine, fraction, weight = node
        if stroke:
            cosine, sine = jnp.cos(stroke[0] + stroke[1] * fraction), jnp.sin(stroke[0] + stroke[1] * fraction)
        values = jnp.stack(signals(p, slice(None), cosine, sine))
        return (sums[0] + weight * values, sums[1] + weight * values * values), None

    def larger(p, best, node):
        value = jnp.abs(signals(p, slice(None), node[0], node[1])[0])
        return (jnp.maximum(best[0], value), jnp.where(value > best[0], 2.0 * np.pi * node[2], best[1])), None

    def of_block(p):
        zero = jnp.zeros((peer.count, JAX_BLOCK))
        if peer.statistic == "peak":
            (_, at), _ = jax.lax.scan(lambda best, node: larger(p, best, node), (zero[0], zero[0]), nodes, unroll=8)
            return _peak(signals, jnp, _alone)(p, slice(None), at, turn[1])[None]
        stroke = slow_stroke(jnp, p) if peer.is_stroke else None
        # A loop whose angles are constants is twice as fast unrolled; one that computes sines is slower.
        unroll = 1 if peer.is_stroke else count
        sums, _ = jax.lax.scan(lambda sums, node: add(p, stroke, sums, node), (zero, zero), nodes, unroll=unroll)
        return peer.finish(jnp, *sums)

    def of_all(p):
        blocks = p.reshape(len(p), -1, JAX_BLOCK).swapaxes(0, 1)
        return jax.lax.map(of_block, blocks).swapaxes(0, 1).reshape(-1, p.shape[1])

    return jax.jit(of_all)


#: Loops over blocks of designs for Numba: sums of moments, and the node with the largest magnitude.
_LOOPS = """
def sums(p, cosines, sines, fractions, weights, first, length, means, squares):
    tile = np.empty((COUNT, LANES))
    for start in range(0, p.shape[1], LANES):
        for node in range(len(weights)):
            c, s, weight = cosines[node], sines[node], weights[node]
            for i in range(LANES):
                STROKE
                ROWS = signals(p, start + i, c, s)
            for k in range(COUNT):
                for i in range(LANES):
                    means[k, start + i] += weight * tile[k, i]
                    squares[k, start + i] += weight * tile[k, i] * tile[k, i]

def peak(p, cosines, sines, largest):
    tile, best, at = np.empty((COUNT, LANES)), np.empty(LANES), np.empty(LANES)
    step = 2.0 * np.pi / len(cosines)
    for start in range(0, p.shape[1], LANES):
        best[:], at[:] = 0.0, 0.0
        for node in range(len(cosines)):
            c, s = cosines[node], sines[node]
            for i in range(LANES):
                ROWS = signals(p, start + i, c, s)
            for i in range(LANES):
                value = abs(tile[0, i])
                at[i] = step * node if value > best[i] else at[i]
                best[i] = value if value > best[i] else best[i]
        for i in range(LANES):
            largest[start + i] = refined(p, start + i, at[i], step)
"""
#: An angle of its own for each design.
_STROKE = "angle = first[start + i] + length[start + i] * fractions[node]; c, s = np.cos(angle), np.sin(angle)"


def numba_function(peer, count):
    """A function of parameters (p, n) to statistics (k, n), compiled: a loop over nodes, its lanes are designs."""
    compiled = numba.njit(**OPTIONS)
    signals = compiled(peer.signals(np.sqrt, compiled))
    fractions, weights = _rule(peer, count)
    cosines, sines = np.cos(2.0 * np.pi * fractions), np.sin(2.0 * np.pi * fractions)
    rows = "".join(f"tile[{k}, i], " for k in range(peer.count))
    names = {"np": np, "signals": signals, "LANES": LANES, "COUNT": peer.count}
    names["refined"] = _peak(signals, np, compiled)
    exec(_LOOPS.replace("ROWS", rows).replace("STROKE", _STROKE if peer.is_stroke else "pass"), names)
    loop = compiled(names["peak" if peer.statistic == "peak" else "sums"])

    def function(p):
        if peer.statistic == "peak":
            largest = np.empty(p.shape[1])
            loop(p, cosines, sines, largest)
            return largest[None]
        first, length = slow_stroke(np, p) if peer.is_stroke else np.zeros((2, 1))
        means, squares = np.zeros((2, peer.count, p.shape[1]))
        loop(p, cosines, sines, fractions, weights, first, length, means, squares)
        return peer.finish(np, means, squares)

    return function
