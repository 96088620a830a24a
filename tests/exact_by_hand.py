"""The mechanisms of ``benchmarks/by_hand.py`` in 80 bits, and their moments by equal steps until two counts agree."""

import numpy as np

WIDE = np.longdouble
#: The 80 bits hold pi; a double does not.
PI = WIDE("3.14159265358979323846264338327950288")
#: Smallest and largest number of equal steps.
FEWEST, MOST = 512, 2**14


def _dyad(place, rate, change, pivot, link, rocker):
    """The rocker of a link from a moving point: its vector, as a complex number, its rate, and the change of that."""
    apart = pivot - place
    square = abs(apart) ** 2
    along = (square + link**2 - rocker**2) / (2 * square)
    of_link = apart * (along + 1j * np.sqrt(link**2 / square - along**2))
    arm = of_link - apart
    cross = np.imag(np.conj(arm) * of_link)
    turning = np.real(np.conj(of_link) * rate) / cross
    difference = 1j * turning * arm - rate
    along_link = np.real(np.conj(of_link) * (change + turning**2 * arm)) - abs(difference) ** 2
    return arm, turning, along_link / cross


def watt(designs, angles):
    of = {name: column.astype(WIDE)[:, None] for name, column in designs.items()}
    pin = of["crank"] * (np.cos(angles) + 1j * np.sin(angles))
    arm, rate, change = _dyad(pin, 1j * pin, -pin, of["ground"], of["coupler"], of["rocker"])
    tilt = np.radians(designs["tilt"]).astype(WIDE)[:, None]
    other = arm * (np.cos(tilt) + 1j * np.sin(tilt)) * of["arm"] / of["rocker"]
    pivot = of["right"] + 1j * of["up"]
    _, output, its_change = _dyad(
        other, 1j * rate * other, (1j * change - rate**2) * other, pivot, of["link"], of["output"]
    )
    return {"rocker_velocity": rate, "rocker_acceleration": change, "output_velocity": output,
            "output_acceleration": its_change}  # fmt: skip


def whitworth(designs, angles):
    of = {name: column.astype(WIDE)[:, None] for name, column in designs.items()}
    pin = of["crank"] * (np.cos(angles) + 1j * np.sin(angles))
    from_pivot = pin + 1j * of["offset"]
    # the logarithm of the pin's place: its imaginary part is the angle of the arm
    first = 1j * pin / from_pivot
    rate, change = first.imag, (-pin / from_pivot - first**2).imag
    arm = of["arm"] * from_pivot / abs(from_pivot)
    far = np.sqrt(of["link"] ** 2 - arm.imag**2)
    position, slope = arm.real + far, -arm.imag - arm.imag * arm.real / far
    bend = -arm.real - (arm.real**2 - arm.imag**2) / far - (arm.imag * arm.real) ** 2 / far**3
    return {"arm_velocity": rate, "ram_position": position, "ram_velocity": slope * rate,
            "ram_acceleration": bend * rate**2 + slope * change}  # fmt: skip


def moments(signals, designs):
    """Mean and variance of each signal, {name: (2, n)}, and which of the n designs they are known of."""
    n = len(next(iter(designs.values())))
    result, todo, count, known = {}, np.arange(n), FEWEST, np.zeros(n, dtype=bool)
    while len(todo) and count <= MOST:
        angles = (2 * np.arange(count).astype(WIDE) + 1 - count) * PI / count
        size, change = max(1, 2**20 // count), np.zeros(len(todo))
        for begin in range(0, len(todo), size):
            here = todo[begin : begin + size]
            for name, values in signals({key: column[here] for key, column in designs.items()}, angles).items():
                mean = values.mean(axis=1)
                found = np.array([mean, ((values - mean[:, None]) ** 2).mean(axis=1)])
                column = result.setdefault(name, np.full((2, n), np.nan, dtype=WIDE))
                scale = np.array([np.sqrt(found[0] ** 2 + found[1]), found[0] ** 2 + found[1]])
                apart = (np.abs(found - column[:, here]) / scale).max(axis=0)
                part = change[begin : begin + size]
                part[:] = np.maximum(part, apart)  # not a number in the first round
                column[:, here] = found
        known[todo[change <= 1e-16]] = True
        todo, count = todo[~(change <= 1e-16)], 2 * count
    return result, known
