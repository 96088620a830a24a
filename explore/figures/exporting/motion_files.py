"""The motion of a design as CSV, HDF5 and MATLAB files: signals and points, with their units."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from explore.base.errors import RequestError
from explore.figures.simulation import SimulatedDesign
from explore.model.output_slider import TRAVEL
from explore.model.points import coordinates
from explore.model.quantities import FloatArray, Parameter, Signal
from explore.running.public import simulate

#: Number of rows of a motion: evenly spaced input angles of a turn from 0, or of a part of it with both ends.
ROWS = 360
#: Longest name of a field in a MATLAB file of version 5.
_LONGEST_NAME = 63


@dataclass(frozen=True)
class Motion:
    """The motion of a design: the input angle and the signals by name, and points of the drawing, mm.

    The parameters of the design have defaults too.
    """

    title: str
    mechanism: str
    parameters: dict[str, float]
    signals: dict[str, FloatArray]
    points: dict[str, FloatArray]
    units: dict[str, str]
    long_names: dict[str, str]


def motion_of(simulated: SimulatedDesign) -> Motion:
    """The motion of a design at `ROWS` input angles."""
    mechanism, parameters = simulated.mechanism, dict(simulated.parameters)
    points = coordinates(mechanism.points, parameters)
    angles = ROWS if simulated.span.is_turn else simulated.span.evenly(ROWS)
    frame = simulate(mechanism.name, parameters, points=points, target=mechanism.target, angles=angles)
    angle = frame.index.to_numpy()
    columns = {str(name): frame[name].to_numpy() for name in frame}
    described: list[Parameter | Signal] = [p for p in mechanism.parameters if p.name in parameters]
    input_name, pose = str(frame.index.name), simulated.pose_of(columns, angle)
    if simulated.slider is not None:
        columns[TRAVEL] = np.asarray(pose.lengths[TRAVEL])
    described += [signal for signal in simulated.signals if signal.name in columns]
    return Motion(
        simulated.title,
        mechanism.name,
        parameters,
        {input_name: angle, **columns},
        pose.points(drawing) if (drawing := simulated.drawing) else {},
        {input_name: "deg", **{item.name: item.unit for item in described}},
        {input_name: mechanism.input_angle, **{item.name: item.long_name for item in described}},
    )


def write_csv(motion: Motion, path: Path) -> None:
    """Write a table whose headings are names with units; every number is read back exactly."""
    columns = {f"{name} [{motion.units[name]}]": values for name, values in motion.signals.items()}
    for name, places in motion.points.items():
        columns |= {f"{name} {axis} [mm]": places[:, k] for k, axis in enumerate("xy")}
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))


def write_hdf5(motion: Motion, path: Path) -> None:
    """Write groups of signals, points and parameters; units and meanings are attributes."""
    import h5py

    content = BytesIO()  # HDF5 crashes on a full disk
    with h5py.File(content, "w") as file:
        file.attrs.update({"title": motion.title, "mechanism": motion.mechanism})
        groups: dict[str, Mapping[str, FloatArray | float]] = {
            "motion": motion.signals,
            "parameters": motion.parameters,
            "points": motion.points,
        }
        for group, values in groups.items():
            for name, value in values.items():
                dataset = file.create_dataset(f"{group}/{name}", data=value)
                dataset.attrs["units"] = "mm" if group == "points" else motion.units[name]
                if group != "points":
                    dataset.attrs["long_name"] = motion.long_names[name]
    path.write_bytes(content.getvalue())


def write_mat(motion: Motion, path: Path) -> None:
    """Write the structures motion, points, parameters, units and long_names, of fields by name."""
    from scipy.io import savemat

    names = [*motion.signals, *motion.parameters]
    too_long = next((name for name in names if len(name) > _LONGEST_NAME), None)
    if too_long is not None:
        raise RequestError(f"MATLAB's names have at most {_LONGEST_NAME} letters; '{too_long}' has {len(too_long)}")
    content = {
        "mechanism": motion.mechanism,
        "title": motion.title,
        "motion": motion.signals,
        "points": {re.sub(r"\W+", "_", name): places for name, places in motion.points.items()},
        "parameters": motion.parameters,
        "units": motion.units,
        "long_names": motion.long_names,
    }
    content = {name: value for name, value in content.items() if value != {}}  # SciPy writes no empty structure
    savemat(str(path), content, appendmat=False, long_field_names=True, oned_as="column")
