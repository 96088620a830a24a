"""Compute campaign.npz: 10,000 random crank-rockers and their statistics in quadruple precision.

Run by hand: ``python tests/reference/make_campaign.py`` (about five minutes; needs gcc). README.md in this folder
describes the result; the tests recompute some of it with mpmath.
"""

import ctypes
import math
import subprocess
import tempfile
from fractions import Fraction
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SEED, DESIGNS, WITH_EXTREMES, WITH_CLUTCH = 20240607, 10_000, 10_000, 4_000
PHASES = (1, 2, 3, 4, 6)
KINDS = ("general", "extreme ratios", "near kite", "both ends singular", "tiny crank")
NODES = 24


def margin(crank, coupler, rocker, ground):
    """Exact Grashof margin over the longest link, for a shortest crank."""
    r1, r2, r3, r4 = map(Fraction, (crank, coupler, rocker, ground))
    return float((r1 + r2 + r3 + r4 - 2 * (max(r2, r3, r4) + r1)) / max(r2, r3, r4))


def draw(rng, kind):
    """Lengths (crank shortest) of one kind, the longest set so that the relative margin is log-uniform."""
    relative_margin = 10.0 ** rng.uniform(-12.0, 0.0)
    if kind == "general":
        lengths = 10.0 ** rng.uniform(-1.5, 0.0, 4) if rng.random() < 0.7 else rng.uniform(0.05, 1.0, 4)
    elif kind == "extreme ratios":
        lengths = 10.0 ** rng.uniform(-3.0, 0.0, 4)
    elif kind == "tiny crank":
        lengths = np.append(10.0 ** rng.uniform(-6.0, -2.0), rng.uniform(0.3, 1.0, 3))
    else:
        # two pairs of nearly equal links: a kite (crank and ground; the distance of pin and pivot nearly vanishes) or
        # a flat parallelogram (crank and rocker, coupler and ground: all in line at both ends of the turn)
        short, long = rng.uniform(0.05, 0.6), 1.0
        apart = 10.0 ** rng.uniform(-8.0, -0.5)
        if kind == "near kite":
            lengths = np.array(
                [short, long, long * (1 + rng.choice((-1, 1)) * relative_margin * short), short * (1 + apart)]
            )
        else:
            lengths = np.array([short, long, short * (1 + apart), long * (1 + rng.uniform(-0.9, 0.9) * apart * short)])
        return lengths * 10.0 ** rng.uniform(0.0, 3.0)
    lengths = np.concatenate([[lengths.min()], rng.permutation(np.sort(lengths)[1:])]) * 10.0 ** rng.uniform(0.0, 3.0)
    at = 1 + int(np.argmax(lengths[1:]))
    others = [k for k in (1, 2, 3) if k != at]
    lengths[at] = (lengths[others[0]] + lengths[others[1]] - lengths[0]) / (1.0 + relative_margin)
    return lengths


def designs(rng):
    """Lengths, branches and kinds: crank strictly shortest, relative margin at least 1e-12."""
    shares = rng.choice(len(KINDS), DESIGNS, p=(0.5, 0.15, 0.1, 0.1, 0.15))
    lengths = np.empty((DESIGNS, 4))
    for i, kind in enumerate(shares):
        while True:
            trial = draw(rng, KINDS[kind])
            if trial[0] < trial[1:].min() and margin(*trial) >= 1e-12:
                break
        lengths[i] = trial
    return lengths, np.where(rng.random(DESIGNS) < 0.2, -1.0, 1.0), shares.astype(np.int8)


def compiled(folder):
    """The quadruple-precision library."""
    path = Path(folder) / "campaign.so"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", path, HERE / "campaign.c", "-lquadmath", "-lm"], check=True)
    library = ctypes.CDLL(str(path))
    array = np.ctypeslib.ndpointer(np.float64, flags="C")
    library.strokes.argtypes = [ctypes.c_long, array, array, array]
    library.extremes.argtypes = [ctypes.c_long, array, array, array, np.ctypeslib.ndpointer(np.int32, flags="C")]
    library.clutch.argtypes = [ctypes.c_long, array, array, ctypes.c_int, array]
    for function in (library.strokes, library.extremes, library.clutch):
        function.restype = None
    return library


def main():
    """Write campaign.npz."""
    lengths, branch, kind = designs(np.random.default_rng(SEED))
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(folder)
        library.gauss(NODES)
        windows = np.empty((DESIGNS, 3, 9))
        library.strokes(DESIGNS, lengths, branch, windows)
        library.gauss(NODES + 10)
        check = np.empty((200, 3, 9))
        library.strokes(200, lengths[::50].copy(), branch[::50].copy(), check)
        mean, variance = check[..., 1:5], check[..., 5:]
        square = mean**2 + variance
        print("other rule, mean/rms:", np.max(np.abs(windows[::50, :, 1:5] - mean) / np.sqrt(square)))
        print("other rule, variance/rms^2:", np.max(np.abs(windows[::50, :, 5:] - variance) / square))
        print("lengths of the strokes:", np.max(np.abs(windows[:, :2, 0].sum(1) / (2 * math.pi) - 1)))
        library.gauss(NODES)
        extremes = np.empty((WITH_EXTREMES, 3, 2, 2))
        peaks = np.empty(WITH_EXTREMES, dtype=np.int32)
        library.extremes(WITH_EXTREMES, lengths[:WITH_EXTREMES].copy(), branch[:WITH_EXTREMES].copy(), extremes, peaks)
        clutch = np.empty((WITH_CLUTCH, len(PHASES), 2, 5))
        for at, phases in enumerate(PHASES):
            out = np.empty((WITH_CLUTCH, 2, 5))
            library.clutch(WITH_CLUTCH, lengths[:WITH_CLUTCH].copy(), branch[:WITH_CLUTCH].copy(), phases, out)
            clutch[:, at] = out
            print(phases, "switches:", np.unique(out[..., 4], return_counts=True), flush=True)
    # the largest output is the extreme of the rocker velocity in that direction; that of the clutch is only sampled
    largest, smallest = extremes[:WITH_CLUTCH, 2, 0, 1], extremes[:WITH_CLUTCH, 2, 0, 0]
    for stroke in (0, 1):
        up = windows[:WITH_CLUTCH, stroke, 2] > 0
        clutch[:, :, stroke, 3] = np.where(up, largest, -smallest)[:, None]
    np.savez_compressed(
        HERE / "campaign.npz",
        lengths=lengths, branch=branch.astype(np.int8), kind=kind, interval=windows[..., 0],
        mean=windows[..., 1:5], variance=windows[..., 5:], extremes=extremes, peaks=peaks.astype(np.int8),
        clutch=clutch[..., :4], switches=clutch[..., 4].astype(np.int8),
    )  # fmt: skip


if __name__ == "__main__":
    main()
