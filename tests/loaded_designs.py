"""Random designs under any loads, a load of each being 0 in two designs of five."""

import numpy as np

#: Largest loads but for a factor of 0.1 to 3.
_ON_SLIDERS = {
    "opposing_force": 50.0, "constant_force": 50.0, "stiffness": 2e3, "damping": 50.0, "rod_mass": 2.0,
    "rod_inertia": 0.01,
}  # fmt: skip
_ON_ROCKERS = {
    "constant_torque": 5e3, "opposing_torque": 5e3, "stiffness": 143e3, "damping": 100.0, "inertia": 8.0,
    "coupler_mass": 25.0, "rocker_mass": 60.0,
}  # fmt: skip


def _draw_loads(rng, count, largest):
    loads = {
        load: rng.uniform(0.0, most, count) * 10.0 ** rng.uniform(-1.0, 0.5, count) for load, most in largest.items()
    }
    return {load: np.where(rng.random(count) < 0.4, 0.0, size) for load, size in loads.items()}


def any_grooves(count, seed):
    """Variable cranks with reversals from 0.003 rad to nearly all of the turn, with and without friction."""
    rng = np.random.default_rng(seed)
    rod, speed = 10.0 ** rng.uniform(1.7, 2.5, count), 10.0 ** rng.uniform(0.0, 1.3, count)
    designs = {
        "rod": rod, "speed": speed, "slider_speed": rod * speed * 10.0 ** rng.uniform(-2.5, -0.3, count),
        "reversal_time": 10.0 ** rng.uniform(-2.5, 0.4, count) / speed, "blend_order": rng.integers(1, 4, count) * 1.0,
        "mass": 10.0 ** rng.uniform(-1.0, 1.0, count),
        "friction": np.where(rng.random(count) < 0.3, 0.0, 10.0 ** rng.uniform(-2.0, -0.2, count)),
    }  # fmt: skip
    return designs | _draw_loads(rng, count, _ON_SLIDERS)


def any_sliders(count, seed):
    """Slider-cranks with rods down to the limit, a tenth of them within 1e-5 to 1e-2 of it; friction up to 0.4."""
    rng = np.random.default_rng(seed)
    crank, offset = 10.0 ** rng.uniform(1.0, 2.0, count), rng.uniform(-30.0, 30.0, count)
    gap = np.where(rng.random(count) < 0.1, 10.0 ** rng.uniform(-5.0, -2.0, count), rng.uniform(0.2, 4.0, count))
    designs = {
        "crank": crank, "offset": offset, "rod": (crank + np.abs(offset)) * (1.0 + gap),
        "speed": 10.0 ** rng.uniform(0.0, 2.0, count), "mass": 10.0 ** rng.uniform(-1.0, 1.0, count),
        "friction": np.where(rng.random(count) < 0.2, 0.0, rng.uniform(0.01, 0.4, count)),
    }  # fmt: skip
    return designs | _draw_loads(rng, count, _ON_SLIDERS)


def any_rockers(count, seed):
    """Crank-rockers of ordinary proportions."""
    rng = np.random.default_rng(seed)
    ranges = {"crank": (50, 150), "coupler": (500, 1300), "rocker": (200, 660), "ground": (300, 830), "speed": (5, 60)}
    designs = {name: rng.uniform(*bounds, count) for name, bounds in ranges.items()}
    return designs | _draw_loads(rng, count, _ON_ROCKERS)
