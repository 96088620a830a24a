"""Means and variances of four signals by explore, NumPy and JAX, all to 1e-9: CPU time per design, interleaved.

Run with ``python benchmarks/peers.py``; JAX is left out where it is not installed (``pip install ".[jax]"``). The peers
are written for this one question: textbook vector formulas, the same number of samples for all designs, no check of a
design. The samples are equispaced over a turn, Gauss-Legendre nodes over a stroke. Their number is the least with which
the worst of all designs has an error up to the tolerance; `explore` chooses it for each design without that knowledge.
"""

import statistics
from importlib.util import find_spec

import numpy as np
from timing import cpu_times

import explore

DESIGNS, REPETITIONS, TOLERANCE = 65_536, 15, 1e-9
RANGES = {"crank": (60, 140), "coupler": (900, 1000), "rocker": (500, 600), "ground": (700, 800)}
SIGNALS = ("coupler_velocity", "rocker_velocity", "coupler_acceleration", "rocker_acceleration")
METRICS = [f"{signal}_{statistic}" for statistic in ("mean", "variance") for signal in SIGNALS]
#: Designs of a block whose arrays stay in the cache: the fastest powers of two from 64 to 4096 and from 256 to 16,384.
NUMPY_BLOCK, JAX_BLOCK = 512, 2048


def four_signals(xp, lengths, cosine, sine):
    """`SIGNALS` at crank angles, by the functions of an array module `xp`."""
    r1, r2, r3, r4 = lengths
    bx, by = r1 * cosine, r1 * sine
    dx, dy = r4 - bx, -by
    d2 = dx * dx + dy * dy
    area = 0.5 * xp.sqrt((d2 - (r2 - r3) ** 2) * ((r2 + r3) ** 2 - d2))
    one_over_d2, one_over_area = 1.0 / d2, 1.0 / area
    k, m = 0.5 + 0.5 * (r2 - r3) * (r2 + r3) * one_over_d2, area * one_over_d2
    ux, uy = k * dx - m * dy, k * dy + m * dx
    vx, vy = ux - dx, uy - dy
    w3, w2 = (ux * by - uy * bx) * one_over_area, (vx * by - vy * bx) * one_over_area
    square2, square3 = w2 * w2, w3 * w3
    px, py = square3 * vx - square2 * ux - bx, square3 * vy - square2 * uy - by
    return w2, w3, -(px * vx + py * vy) * one_over_area, -(px * ux + py * uy) * one_over_area


def slow_stroke(xp, lengths):
    """First crank angle and length of the slower stroke, between the limit positions, rad."""
    r1, r2, r3, r4 = lengths
    extended, overlapped = (
        xp.arccos((reach * reach + r4 * r4 - r3 * r3) / (2.0 * reach * r4)) for reach in (r2 + r1, r2 - r1)
    )
    length = extended - overlapped + np.pi
    return xp.where(length > np.pi, overlapped - np.pi, extended), xp.maximum(length, 2.0 * np.pi - length)


def quadrature(window, count):
    """Fractions of the window and weights of sum 1."""
    if window == "cycle":
        return np.arange(count) / count, np.full(count, 1.0 / count)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 + 0.5 * nodes, 0.5 * weights


def by_explore(window, designs):
    """Statistics, shape (8, n), and number of nodes, shape (n,)."""
    table = explore.evaluate("crank-rocker", designs, metrics=METRICS, window=window, drive="slow", tolerance=TOLERANCE)
    return table[METRICS].to_numpy().T, table["nodes"].to_numpy()


def by_numpy(window, count, lengths):
    """Statistics, shape (8, n), in blocks whose arrays stay in the cache."""
    fractions, weights = quadrature(window, count)
    turn = 2.0 * np.pi * fractions
    cosine, sine = np.cos(turn), np.sin(turn)
    out = np.empty((8, len(lengths)))
    for start in range(0, len(lengths), NUMPY_BLOCK):
        block = slice(start, start + NUMPY_BLOCK)
        columns = lengths[block].T[:, :, None]
        if window != "cycle":
            first, length = slow_stroke(np, columns)
            angle = first + length * fractions
            cosine, sine = np.cos(angle), np.sin(angle)
        for s, signal in enumerate(four_signals(np, columns, cosine, sine)):
            mean = signal @ weights
            deviation = signal - mean[:, None]
            out[s, block], out[4 + s, block] = mean, (deviation * deviation) @ weights
    return out


def jax_function(window, count):
    """A compiled function of lengths (n, 4) to statistics (8, n): a loop over nodes, its lanes are designs."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    fractions, weights = quadrature(window, count)
    turn = 2.0 * np.pi * fractions
    nodes = np.column_stack([np.cos(turn), np.sin(turn), fractions, weights])

    def of_block(rows):
        lengths = rows.T
        first, length = slow_stroke(jnp, lengths)

        def add(sums, node):
            cosine, sine, fraction, weight = node
            if window != "cycle":
                angle = first + length * fraction
                cosine, sine = jnp.cos(angle), jnp.sin(angle)
            signals = jnp.stack(four_signals(jnp, lengths, cosine, sine))
            return (sums[0] + weight * signals, sums[1] + weight * signals * signals), None

        zero = jnp.zeros((4, JAX_BLOCK))
        # squares and their cancelling difference cost one digit here and save a second pass; a loop whose angles are
        # constants is twice as fast unrolled, one that computes sines is slower
        (mean, square), _ = jax.lax.scan(add, (zero, zero), nodes, unroll=count if window == "cycle" else 1)
        return jnp.concatenate([mean, square - mean * mean])

    return jax.jit(lambda rows: jax.lax.map(of_block, rows.reshape(-1, JAX_BLOCK, 4)).swapaxes(0, 1).reshape(8, -1))


def worst_error(values, exact):
    """Largest error: of a mean relative to the root mean square, of a variance to itself."""
    square = exact[:4] ** 2 + exact[4:]
    means, variances = np.abs(values - exact)[:4] / np.sqrt(square), np.abs(values - exact)[4:] / exact[4:]
    return max(means.max(), variances.max())


def cpu_seconds(jobs):
    """Median CPU time of each job, all threads together; the jobs alternate."""
    return {name: statistics.median(times) for name, times in cpu_times(jobs, REPETITIONS).items()}


def compare(window, designs, has_jax):
    """Print a line for each implementation."""
    lengths = np.column_stack(list(designs.values()))
    exact = by_numpy(window, 128, lengths)  # far more than are needed: only rounding remains
    count = next(n for n in range(8, 128, 2) if worst_error(by_numpy(window, n, lengths), exact) <= TOLERANCE)
    jobs = {"explore": lambda: by_explore(window, designs), "NumPy": lambda: (by_numpy(window, count, lengths), count)}
    if has_jax:
        function = jax_function(window, count)
        jobs["JAX"] = lambda: (np.asarray(function(lengths)), count)
    seconds = cpu_seconds(jobs)
    for name, job in jobs.items():
        values, nodes = job()
        print(
            f"{name:16s}{np.mean(nodes):5.1f}{worst_error(values, exact):14.0e}{seconds[name] / DESIGNS * 1e9:12.0f} ns"
            f"{seconds[name] / seconds['explore']:14.2f}"
        )


def main() -> None:
    rng = np.random.default_rng(0)
    designs = {name: rng.uniform(*bounds, DESIGNS) for name, bounds in RANGES.items()}
    has_jax = find_spec("jax") is not None
    if not has_jax:
        print("JAX is left out: it is not installed; pip install '.[jax]'")
    for window, title in {"cycle": "full turn", "drive": "slower stroke"}.items():
        print(f"{title:16s}nodes   worst error   CPU a design   explore = 1")
        compare(window, designs, has_jax)


if __name__ == "__main__":
    main()
