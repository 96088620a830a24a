"""The formats by the endings of names, and `export`."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from explore.base.errors import RequestError
from explore.figures.exporting.animated_svg import write_animated_svg
from explore.figures.exporting.chosen import DesignOfParameters, DesignOfResults
from explore.figures.exporting.dxf import write_dxf
from explore.figures.exporting.frames import has_ffmpeg, write_gif, write_mp4
from explore.figures.exporting.motion_files import motion_of, write_csv, write_hdf5, write_mat
from explore.figures.exporting.sheet import draw_sheet
from explore.figures.exporting.svg import write_svg
from explore.results.store.open_results import ResultsOrPath, results_of
from explore.results.store.outputs import new_output
from explore.results.store.results import Results
from explore.running.public import list_mechanisms
from explore.studies.config.linkage import Linkage

Design = DesignOfResults | DesignOfParameters
#: Writers by ending; a longer ending is looked for first. Not .h5, which results have.
_WRITERS: dict[str, Callable[[Design, Path], object]] = {
    ".animated.svg": lambda design, path: write_animated_svg(design.simulated, path),
    ".toml": lambda design, path: path.write_text(design.study, encoding="utf-8"),
    ".csv": lambda design, path: write_csv(motion_of(design.simulated), path),
    ".hdf5": lambda design, path: write_hdf5(motion_of(design.simulated), path),
    ".mat": lambda design, path: write_mat(motion_of(design.simulated), path),
    ".dxf": lambda design, path: write_dxf(draw_sheet(design.simulated), path),
    ".svg": lambda design, path: write_svg(draw_sheet(design.simulated), path),
    ".gif": lambda design, path: write_gif(design.simulated, path),
    ".mp4": lambda design, path: write_mp4(design.simulated, path),
}


def export(
    source: ResultsOrPath | Linkage,
    path: Path | str | Sequence[Path | str],
    *,
    design: int | None = None,
    parameters: Mapping[str, float | str] | None = None,
    points: Mapping[str, Sequence[float | str]] | None = None,
) -> None:
    """Write a design as files for CAD and other tools.

    Parameters
    ----------
    source
        The results of a sweep, or the path of their file; with `parameters` the name of a mechanism, or a
        `Linkage`.
    path
        A file, or several. The ending of the name is the format: ``.toml`` (a study of this design alone that computes
        the same row), ``.csv``, ``.hdf5`` and ``.mat`` (the motion over a turn), ``.dxf`` and ``.svg`` (the drawing at
        1:1), ``.gif``, ``.mp4`` and ``.animated.svg`` (the mechanism moving). Each appears when it is complete.
    design
        Number of the design of results; the best of the Pareto set unless given.
    parameters
        Parameters of a design of a mechanism, in declared units or as strings with a unit.
    points
        Points of its floating link, as of `explore.simulate`.

    Raises
    ------
    MotionError
        If the design has no motion over a full turn.
    RequestError
        If an ending or a name is unknown, a study would be overwritten, the mechanism declares no drawing, ffmpeg is
        missing, or no number is given and no design is feasible.
    ResultsError
        If the design is not in the results, or a file cannot be written.
    """
    paths = [Path(path)] if isinstance(path, (str, Path)) else [Path(each) for each in path]
    writers = [find_writer(each) for each in paths]
    for each in paths:
        if each.suffix.lower() == ".toml" and each.exists():
            raise RequestError(f"{each} exists; a study is not overwritten, so name another file")
    chosen = _choose(source, design, parameters, points or {})
    if isinstance(chosen, DesignOfResults):
        for each in paths:
            if each.exists() and chosen.results.path.exists() and each.samefile(chosen.results.path):
                raise RequestError(f"{each} is the results file itself; name another file with `path`")
    for each, write in zip(paths, writers, strict=True):
        with new_output(each) as unfinished:
            write(chosen, unfinished)


def find_writer(path: Path) -> Callable[[Design, Path], object]:
    """The writer of a file's format; `RequestError` if there is none, or it needs a program that is missing."""
    name = path.name.lower()
    for ending, write in _WRITERS.items():
        if name.endswith(ending):
            if ending == ".mp4" and not has_ffmpeg():
                raise RequestError(
                    f"{path}: MP4 needs the program ffmpeg, which is not installed; .gif needs no program"
                )
            return write
    *others, last = _WRITERS
    raise RequestError(f"{path}: the name must end in {', '.join(others)} or {last}")


def _choose(
    source: ResultsOrPath | Linkage,
    design: int | None,
    parameters: Mapping[str, float | str] | None,
    points: Mapping[str, Sequence[float | str]],
) -> Design:
    if parameters is None:
        if isinstance(source, Linkage):
            raise RequestError("a linkage alone is no design; give its parameters")
        if isinstance(source, str) and source in list_mechanisms():
            raise RequestError("a mechanism alone is no design; give its parameters")
        if points:
            raise RequestError("points are given with the parameters of a mechanism; results have their own")
        return DesignOfResults.choose(results_of(source), design)
    if design is not None:
        raise RequestError("a number chooses a design of results; leave it out, or the parameters")
    if isinstance(source, Results):
        raise RequestError("parameters are those of a mechanism; give its name in place of results")
    return DesignOfParameters.read(source if isinstance(source, Linkage) else str(source), parameters, points)
