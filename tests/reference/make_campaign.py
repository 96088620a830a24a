"""Compute campaign.npz and families.npz: random crank-rockers and their statistics in quadruple precision.

Run by hand: ``python tests/reference/make_campaign.py [campaign] [families]`` (about ten minutes for the first, three
for the second; needs gcc). README.md in this folder describes the result; the tests recompute some of it with mpmath.
"""

import ctypes
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SEED, DESIGNS, WITH_CLUTCH = 20240607, 10_000, 4_000
PHASES = (1, 2, 3, 4, 6)
KINDS = ("general", "extreme ratios", "near kite", "both ends singular", "tiny crank")
NODES = 24
FAMILY_SEED, PER_FAMILY = 20261122, 150
FAMILIES = (
    "long ground and coupler",
    "long ground and rocker",
    "long coupler and rocker",
    "very long pair",
    "tiny crank",
    "scale 1e20",
    "scale 1e-20",
    "near kite",
    "both ends singular",
    "general",
)
#: Crank angles in degrees; designs of the families take them in turn, two and two.
INTERVALS = ((0, 90), (90, 270), (-30, 45), (175, 185), (10, 350), (-180, 0), (200, 201), (33, 390))
MOST_PHASES = 12
#: First design of a family: one whose bound was once seen to fail.
KNOWN = {
    "very long pair": (2.5419498904115887e-05, 632053.8674011618, 0.02478957663614228, 632053.8597220634, -1.0),
    "tiny crank": (6.417370346097209e-06, 2.6998670433399297, 3.179770094635058, 1.6634055309307407, 1.0),
}


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


def draw_long_pair(rng, family):
    """Lengths of which two are long, by 32 to 1e4 (very long: 1e8); the pair differs by at most what lets a crank turn.

    With a crank of 0 the limit of long ground and coupler is a rocking yoke, of long ground and rocker a slider-crank.
    """
    pairs = {"long ground and coupler": (1, 3), "long ground and rocker": (2, 3), "long coupler and rocker": (1, 2)}
    pair = pairs[family] if family in pairs else rng.permutation(list(pairs.values()))[0]
    ratio = 10.0 ** (rng.uniform(1.5, 4.0) if family in pairs else rng.uniform(4.0, 8.0))
    crank = 1.0 - rng.uniform() ** 2 if rng.random() < 0.5 else 10.0 ** rng.uniform(-3.0, 0.0)
    # half of the designs well inside the range, the others close to a change point
    share = rng.uniform(0.0, 1.0) if rng.random() < 0.5 else 1.0 - 10.0 ** rng.uniform(-8.0, 0.0)
    lengths = np.array([crank, 1.0, 1.0, 1.0])
    lengths[pair[0]] = ratio
    lengths[pair[1]] = ratio + rng.choice((-1, 1)) * share * min(1.0 - crank, crank if rng.random() < 0.5 else 1.0)
    return lengths * 10.0 ** rng.uniform(-3.0, 3.0)


def draw_tiny_crank(rng):
    """Lengths with a crank of 1e-9 to 1e-3 of the other links, of which half can nearly be in line."""
    others = rng.uniform(0.3, 1.0, 3)
    crank = 10.0 ** rng.uniform(-9.0, -3.0)
    if rng.random() < 0.5:
        at = int(rng.integers(3))
        others[at] = (others.sum() - others[at] - crank) / (1.0 + 10.0 ** rng.uniform(-9.0, 0.0))
    return np.append(crank, others) * 10.0 ** rng.uniform(-1.0, 3.0)


def draw_family(rng, family):
    """Lengths of one of the FAMILIES."""
    if "pair" in family or "long" in family:
        return draw_long_pair(rng, family)
    if family == "tiny crank":
        return draw_tiny_crank(rng)
    if family.startswith("scale"):
        return draw(rng, "general") * float(family.removeprefix("scale "))
    return draw(rng, family)


def is_crank_rocker(lengths):
    """Whether the crank is strictly shortest and the relative margin at least 1e-12."""
    return lengths[0] < lengths[1:].min() and margin(*lengths) >= 1e-12


def family_designs(rng):
    """Lengths, shape (families, designs, 4), and branches of the families; both branches alternate."""
    lengths = np.empty((len(FAMILIES), PER_FAMILY, 4))
    branch = np.tile(np.where(np.arange(PER_FAMILY) % 2, -1.0, 1.0), (len(FAMILIES), 1))
    for f, family in enumerate(FAMILIES):
        for i in range(PER_FAMILY):
            while not is_crank_rocker(trial := draw_family(rng, family)):
                pass
            lengths[f, i] = trial
        if family in KNOWN:
            lengths[f, 0], branch[f, 0] = KNOWN[family][:4], KNOWN[family][4]
    return lengths, branch


def designs(rng):
    """Lengths, branches and kinds: crank strictly shortest, relative margin at least 1e-12."""
    shares = rng.choice(len(KINDS), DESIGNS, p=(0.5, 0.15, 0.1, 0.1, 0.15))
    lengths = np.empty((DESIGNS, 4))
    for i, kind in enumerate(shares):
        while not is_crank_rocker(trial := draw(rng, KINDS[kind])):
            pass
        lengths[i] = trial
    return lengths, np.where(rng.random(DESIGNS) < 0.2, -1.0, 1.0), shares.astype(np.int8)


def compiled(folder):
    """The quadruple-precision library."""
    path = Path(folder) / "campaign.so"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", path, HERE / "campaign.c", "-lquadmath", "-lm"], check=True)
    library = ctypes.CDLL(str(path))
    array, integers = np.ctypeslib.ndpointer(np.float64, flags="C"), np.ctypeslib.ndpointer(np.int32, flags="C")
    library.windows.argtypes = [ctypes.c_long, array, array, array, array, integers]
    library.clutch.argtypes = [ctypes.c_long, array, array, integers, array]
    for function in (library.windows, library.clutch):
        function.restype = None
    library.gauss(NODES)
    return library


def reference_windows(library, lengths, branch, degrees):
    """Crank intervals (n, 4), statistics (n, 4, 7, 4) and extremes of the rocker velocity in a turn (n,)."""
    n = len(lengths)
    out, peaks = np.empty((n, 4, 29)), np.empty(n, dtype=np.int32)
    library.windows(n, *map(np.ascontiguousarray, (lengths, branch, degrees)), out, peaks)
    return out[..., 0], out[..., 1:].reshape(n, 4, 7, 4), peaks


def reference_clutch(library, lengths, branch, phases, statistics):
    """Mean, variance, minimum and maximum of the output, and the hand-overs, of both driving strokes, (n, 2, 5)."""
    n = len(lengths)
    out = np.empty((n, 2, 5))
    library.clutch(n, *map(np.ascontiguousarray, (lengths, branch, phases.astype(np.int32))), out)
    # the largest output is the extreme of the rocker velocity on the stroke; that of the clutch is only sampled
    for stroke in (0, 1):
        mean, low, high = (statistics[:, stroke, 1, k] for k in (0, 2, 3))
        out[:, stroke, 3] = np.where(mean > 0, high, -low)
    return out


def print_agreement(library, lengths, branch, degrees, statistics):
    """Compare with a rule of more nodes."""
    library.gauss(NODES + 10)
    _, other, _ = reference_windows(library, lengths, branch, degrees)
    library.gauss(NODES)
    mean, variance = other[..., 0], other[..., 1]
    square = mean**2 + variance
    print("other rule, mean/rms:", np.max(np.abs(statistics[..., 0] - mean) / np.sqrt(square)))
    print("other rule, variance/rms^2:", np.max(np.abs(statistics[..., 1] - variance) / square))


def make_campaign(library):
    """Write campaign.npz."""
    lengths, branch, kind = designs(np.random.default_rng(SEED))
    degrees = np.tile((0.0, 90.0), (DESIGNS, 1))
    interval, statistics, peaks = reference_windows(library, lengths, branch, degrees)
    print_agreement(library, lengths[::50], branch[::50], degrees[::50], statistics[::50])
    some = slice(WITH_CLUTCH)
    clutch = np.empty((WITH_CLUTCH, len(PHASES), 2, 5))
    for at, phases in enumerate(PHASES):
        every = np.full(WITH_CLUTCH, phases)
        clutch[:, at] = reference_clutch(library, lengths[some], branch[some], every, statistics[some])
        print(phases, "switches:", np.unique(clutch[:, at, :, 4], return_counts=True), flush=True)
    np.savez_compressed(
        HERE / "campaign.npz",
        lengths=lengths, branch=branch.astype(np.int8), kind=kind, interval=interval[:, :3],
        mean=statistics[:, :3, :4, 0], variance=statistics[:, :3, :4, 1], extremes=statistics[:, :3, 1:4:2, 2:],
        peaks=peaks.astype(np.int8), clutch=clutch[..., :4], switches=clutch[..., 4].astype(np.int8),
    )  # fmt: skip


def make_families(library):
    """Write families.npz, of which the first two axes are family and design."""
    lengths, branch = family_designs(np.random.default_rng(FAMILY_SEED))
    shape = branch.shape
    lengths, branch = lengths.reshape(-1, 4), branch.reshape(-1)
    pair = np.arange(len(branch)) // 2  # one design of each branch
    degrees = np.array(INTERVALS, dtype=float)[pair % len(INTERVALS)]
    phases = 1 + pair % MOST_PHASES
    interval, statistics, peaks = reference_windows(library, lengths, branch, degrees)
    print_agreement(library, lengths[::9], branch[::9], degrees[::9], statistics[::9])
    clutch = reference_clutch(library, lengths, branch, phases, statistics)
    print("switches:", np.unique(clutch[..., 4], return_counts=True), "peaks:", np.unique(peaks, return_counts=True))
    columns = {
        "lengths": lengths, "branch": branch.astype(np.int8), "degrees": degrees, "phases": phases.astype(np.int8),
        "interval": interval, "statistics": statistics, "peaks": peaks.astype(np.int8),
        "clutch": clutch[..., :4], "switches": clutch[..., 4].astype(np.int8),
    }  # fmt: skip
    by_family = {name: column.reshape(shape + column.shape[1:]) for name, column in columns.items()}
    np.savez_compressed(HERE / "families.npz", families=np.array(FAMILIES), **by_family)


def main():
    """Make the files that the command line names, or both."""
    named = sys.argv[1:] or ["campaign", "families"]
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(folder)
        if "campaign" in named:
            make_campaign(library)
        if "families" in named:
            make_families(library)


if __name__ == "__main__":
    main()
