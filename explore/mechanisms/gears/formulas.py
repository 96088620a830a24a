"""Derived metrics of a gear pair: perimeter, teeth, and the smallest radius of curvature."""

import numpy as np
import numpy.typing as npt

from explore.mechanisms.overall_size import declare_size
from explore.model.quantities import Formula

_Numbers = npt.NDArray[np.float64]


def _perimeter(mean_length: _Numbers) -> _Numbers:
    return 2.0 * np.pi * mean_length


def _tooth_count(perimeter: _Numbers, module: _Numbers) -> _Numbers:
    return perimeter / (np.pi * module)


def _fitting_distance(centre_distance: _Numbers, tooth_count: _Numbers) -> _Numbers:
    return centre_distance * np.maximum(np.round(tooth_count), 1.0) / tooth_count


def _smallest_radius(driver_curvature: _Numbers, driven_curvature: _Numbers) -> _Numbers:
    return 1.0 / np.maximum(driver_curvature, driven_curvature)


def _largest_radii(centre_distance: _Numbers, ratio_min: _Numbers, ratio_max: _Numbers) -> tuple[_Numbers, _Numbers]:
    """Largest pitch radii of gears 1 and 2: the radii of the circles that the pitch curves sweep as they turn."""
    return centre_distance / (1.0 + ratio_min), centre_distance * ratio_max / (1.0 + ratio_max)


def _width(centre_distance: _Numbers, ratio_min: _Numbers, ratio_max: _Numbers) -> _Numbers:
    driver, driven = _largest_radii(centre_distance, ratio_min, ratio_max)
    return driver + centre_distance + driven


def _height(centre_distance: _Numbers, ratio_min: _Numbers, ratio_max: _Numbers) -> _Numbers:
    return 2.0 * np.maximum(*_largest_radii(centre_distance, ratio_min, ratio_max))


FORMULAS = (
    Formula("perimeter", "mm", "length of each pitch curve", None, ("pitch_length_mean_cycle",), _perimeter),
    Formula("curvature_radius_min", "mm", "smallest convex radius of curvature of both pitch curves", "max",
            ("driver_curvature_max_cycle", "driven_curvature_max_cycle"), _smallest_radius),
    Formula("tooth_count", "1", "teeth of each gear at `module`, to be a whole number", None,
            ("perimeter", "module"), _tooth_count),
    Formula("fitting_centre_distance", "mm", "centre distance nearest to the given one with a whole number of teeth",
            None, ("centre_distance", "tooth_count"), _fitting_distance),
    *declare_size("the line of centres", ("centre_distance", "ratio_min", "ratio_max"), _width, _height),
)  # fmt: skip
