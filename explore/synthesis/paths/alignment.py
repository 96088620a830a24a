"""Laying curves of the atlas over a path: the similarity, start and sense of each that fit best."""

from dataclasses import dataclass

import numpy as np

from explore.model.quantities import FloatArray
from explore.synthesis.columns import Columns
from explore.synthesis.linkages import ComplexArray
from explore.synthesis.paths.atlas import N_ANGLES, N_STEPS, even_points
from explore.synthesis.paths.curves import lay_at_angles, lay_parts

#: Number of dense points of the path between two of its given ones.
_N_BETWEEN = 40
#: Parts of a curve that an open path is laid over, as shares of its length.
_SHARES = (0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.8, 0.95)
#: Number of places on a curve where its parts start.
_N_STARTS = 32
#: Number of points of a part.
_N_POINTS = 32
#: Number of first crank angles that timed points are tried at.
_N_PHASES = 48
#: Signs of the columns of a shape in the mirror.
_MIRRORED = np.array([1.0, 1.0, 1.0, 1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Target:
    """A closed path at equal steps of its length, and the places of its given points as shares of the length."""

    points: ComplexArray
    places: FloatArray


def close_path(points: ComplexArray) -> Target:
    """The closed spline through points, by the roots of the chords: it does not overshoot at short ones."""
    from scipy.interpolate import CubicSpline

    closed = np.append(points, points[0])
    chords = np.abs(np.diff(closed))
    knots = np.concatenate([[0.0], np.cumsum(np.sqrt(np.maximum(chords, 1e-9 * chords.max())))])
    between = np.arange(_N_BETWEEN) / _N_BETWEEN
    dense = CubicSpline(knots, closed, bc_type="periodic")(
        (knots[:-1, None] + between * np.diff(knots)[:, None]).ravel()
    )
    lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(np.append(dense, dense[0]))))])
    steps = np.arange(N_STEPS) / N_STEPS * lengths[-1]
    even = np.interp(steps, lengths, np.append(dense, dense[0]).real) + 1j * np.interp(
        steps, lengths, np.append(dense, dense[0]).imag
    )
    return Target(even, lengths[:-1:_N_BETWEEN] / lengths[-1])


@dataclass(frozen=True)
class Starts(Columns):
    """Linkages laid over a path.

    Shapes with their size, (n, 6); pivots of the crank, complex, and angles of the frame, rad; branches and senses, 1
    or -1; crank angles of the given points, rad, (n, k); the share of the path's mean square that the fit leaves.
    """

    shapes: FloatArray
    places: ComplexArray
    frames: FloatArray
    branches: FloatArray
    senses: FloatArray
    angles: FloatArray
    errors: FloatArray


def lay_over(target: Target, shapes: FloatArray) -> Starts:
    """Lay closed curves of shapes over a path: all starts, both senses and both mirror images, the best of each.

    Curves and path are compared at equal steps of their length; the best similarity is a ratio of inner products, which
    for all starts at once is a convolution.
    """
    curves, lengths = even_points(shapes)
    means, path_mean = curves.mean(axis=1), target.points.mean()
    curves, path = curves - means[:, None], target.points - path_mean
    energy = (np.abs(curves) ** 2).sum(axis=1)
    # The four images: as it is, mirrored, reversed, both. A reversed curve starts at the same point.
    reverse = np.concatenate([[0], np.arange(N_STEPS - 1, 0, -1)])
    images = np.stack([curves, curves.conj(), curves[:, reverse], curves.conj()[:, reverse]])
    spectrum = np.fft.fft(path)
    products = np.fft.ifft(spectrum * np.fft.fft(images, axis=2).conj(), axis=2)  # [image, shape, shift]
    fits = np.abs(products) ** 2 / energy[:, None]
    flat = fits.transpose(1, 0, 2).reshape(len(shapes), -1)
    best = flat.argmax(axis=1)
    image, shift = np.divmod(best, N_STEPS)
    rows = np.arange(len(shapes))
    similarity = products[image, rows, shift] / energy
    is_mirrored, is_reversed = image % 2 == 1, image >= 2
    sizes, frames = np.abs(similarity), np.angle(similarity)
    means = np.where(is_mirrored, means.conj(), means)
    # path(s) = similarity image(s - shift): the given points' places on the curve itself.
    along = target.places[None, :] - (shift / N_STEPS)[:, None]
    along = np.where(is_reversed[:, None], -along, along)
    angles = _angles_at(along, lengths)
    angles = np.where(is_mirrored[:, None], -angles, angles)
    scaled = shapes * sizes[:, None]
    scaled[:, 5] = np.where(is_mirrored, -scaled[:, 5], scaled[:, 5])
    senses = np.where(is_mirrored ^ is_reversed, -1.0, 1.0)
    errors = 1.0 - flat[rows, best] / (np.abs(path) ** 2).sum()
    return Starts(
        scaled, path_mean - similarity * means, frames, np.where(is_mirrored, -1.0, 1.0), senses, angles, errors
    )


def _angles_at(places: FloatArray, lengths: FloatArray) -> FloatArray:
    """Crank angles at places along curves, shares of the length that may lie beyond 0 … 1, shape (n, k)."""
    turns = np.floor(places)
    angles = np.arange(N_ANGLES + 1) * (2.0 * np.pi / N_ANGLES)
    found = [np.interp((p - t) * own[-1], own, angles) for p, t, own in zip(places, turns, lengths, strict=True)]
    return np.asarray(np.array(found) + 2.0 * np.pi * turns)


def lay_over_parts(points: ComplexArray, shapes: FloatArray, least_span: float) -> Starts:
    """Lay parts of curves of shapes, (n, 6), over an open path, (k,), the best part of each.

    The crank turns at least by `least_span` over the path, rad.
    """
    arcs = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points)))])
    steps, places = np.linspace(0.0, arcs[-1], _N_POINTS), arcs / arcs[-1]
    even = np.interp(steps, arcs, points.real) + 1j * np.interp(steps, arcs, points.imag)
    curves, lengths = even_points(shapes)
    path = even - even.mean()
    best, chosen = np.empty(len(shapes)), np.zeros((len(shapes), 3), dtype=np.int64)
    lay_parts(curves, lengths, path, np.array(_SHARES), _N_STARTS, least_span, best, chosen)
    share, first, image = np.array(_SHARES)[chosen[:, 0]], chosen[:, 1] / _N_STARTS, chosen[:, 2]
    is_mirrored, is_reversed = image % 2 == 1, image >= 2
    along = np.where(is_reversed[:, None], 1.0 - places, places)
    angles = _angles_at(first[:, None] + share[:, None] * along, lengths)
    signs = np.where(is_mirrored[:, None], -1.0, 1.0)
    return _similar(even, places, shapes, angles * signs, is_mirrored, is_reversed, 1.0 - best / _energy(path))


def _energy(path: ComplexArray) -> float:
    return float((np.abs(path) ** 2).sum())


def _similar(
    even: ComplexArray,
    places: FloatArray,
    shapes: FloatArray,
    angles: FloatArray,
    is_mirrored: np.ndarray,
    is_reversed: np.ndarray,
    errors: FloatArray,
) -> Starts:
    """The starts whose points at the angles lie best over the path, by a similarity."""
    branches = np.where(is_mirrored, -1.0, 1.0)
    own = shapes.copy()
    own[:, 5] *= branches
    steps = np.linspace(0.0, 1.0, len(even))
    target = np.interp(places, steps, even.real) + 1j * np.interp(places, steps, even.imag)
    curve = coupler_points(own, branches, angles)
    similarity, place = fit_similarity(curve, target)
    own *= np.abs(similarity)[:, None]
    return Starts(
        own, place, np.angle(similarity), branches, np.where(is_mirrored ^ is_reversed, -1.0, 1.0), angles, errors
    )


def coupler_points(shapes: FloatArray, branches: FloatArray, angles: FloatArray) -> ComplexArray:
    """Coupler points of shapes in their frames at crank angles of each, shape (n, k)."""
    pins, directions = coupler_places(shapes[:, :4], branches, np.exp(1j * angles))
    along, across = shapes[:, 4:].T[..., None]
    return np.asarray(pins + (along + 1j * across) * directions)


def coupler_places(lengths: FloatArray, branches: FloatArray, rays: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Pins of cranks and unit vectors of couplers, (n, k), of links (n, 4) at directions of cranks, (k,) or (n, k)."""
    crank, coupler, rocker, ground = lengths.T[..., None]
    pins = crank * rays
    diagonal = ground - pins
    square = np.abs(diagonal) ** 2
    share = 0.5 * (square + (coupler - rocker) * (coupler + rocker)) / square
    height = np.sqrt(np.maximum(coupler**2 / square - share**2, 0.0))
    return pins, diagonal * (share + 1j * branches[:, None] * height) / coupler


def fit_similarity(curves: ComplexArray, path: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """The factor and shift that bring each row of points nearest to a path, least squares, each (n,)."""
    means, middle = curves.mean(axis=1), path.mean()
    centred = curves - means[:, None]
    factor = (centred.conj() * (path - middle)).sum(axis=1) / ((np.abs(centred) ** 2).sum(axis=1) + 1e-300)
    return factor, middle - factor * means


def lay_timed(points: ComplexArray, angles: FloatArray, shapes: FloatArray, *, is_shift_free: bool) -> Starts:
    """Lay shapes, (n, 6), over points with crank angles, (k,), both branches, the best first angle of each.

    The angles, rad, count from any angle if the shift is free, else from the frame.
    """
    shifts = np.arange(_N_PHASES) * (2.0 * np.pi / _N_PHASES) if is_shift_free else np.zeros(1)
    own, branches = np.concatenate([shapes, shapes * _MIRRORED]), np.repeat([1.0, -1.0], len(shapes))
    best, errors = np.zeros(len(own), dtype=np.int64), np.empty(len(own))
    middle = points - points.mean()
    lay_at_angles(own, branches, np.exp(1j * (shifts[:, None] + angles)), middle, best, errors)
    turned = angles + shifts[best][:, None]
    factor, place = fit_similarity(coupler_points(own, branches, turned), points)
    senses = np.full(len(own), 1.0 if angles[-1] >= angles[0] else -1.0)
    sizes = np.abs(factor)[:, None]
    return Starts(own * sizes, place, np.angle(factor), branches, senses, turned, errors / _energy(middle))
