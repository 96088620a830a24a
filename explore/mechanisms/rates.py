"""Rates of places and angles, declared as signals."""

from explore.model.quantities import Signal


def rates_of(of: str, unit: str, words: str, rows: tuple[int, int], needs: tuple[int, int]) -> tuple[Signal, Signal]:
    """Velocity and acceleration of a signal whose last word, such as "position", these have instead in their names.

    The rates are per second of a unit; `words` has "{}" for the rate.
    """
    name = of.rpartition("_")[0]
    velocity, acceleration = f"{name}_velocity", f"{name}_acceleration"
    first, second = (words.format(rate) for rate in ("velocity", "acceleration"))
    return (
        Signal(velocity, f"{unit}/s", first, rows[0], needs[0], 1, derivative_of=of),
        Signal(acceleration, f"{unit}/s^2", second, rows[1], needs[1], 2, 4, derivative_of=velocity),
    )
