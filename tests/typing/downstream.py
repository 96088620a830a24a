"""A program that uses every public name of explore, checked by ``mypy --strict`` as a user's own would be."""

import pickle
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import explore
from explore import charts


def build_study() -> explore.Study:
    """A small study of all kinds of entries."""
    return explore.Study(
        mechanism="crank-rocker",
        parameters={
            "crank": {"start": 60, "stop": 160, "num": 6},
            "coupler": 1083.4236,
            "rocker": [500, "54.17118 cm"],
            "ground": np.linspace(600.0, 800.0, 5),
            "speed": "40 rpm",
        },
        window="drive",
        drive="slow",
        metrics=["mean_output_ratio", "transmission_angle_min", "cv", "rocker_acceleration_max"],
        constraints={"transmission_angle_min": {"min": "20 deg"}},
        objectives=["cv", "rocker_acceleration_max:min"],
        tolerance=1e-9,
    )


def sweep_study(study: explore.Study, folder: Path) -> explore.Results:
    """Compute the study, and read it back in every way."""
    path = folder / "study.toml"
    path.write_text(study.to_toml(), encoding="utf-8")
    same: explore.Study = explore.load_study(path)
    assert same == study == pickle.loads(pickle.dumps(study))
    with warnings.catch_warnings():
        warnings.simplefilter("error", explore.FailedBlocksWarning)
        warnings.simplefilter("ignore", explore.DoubtfulInputWarning)
        warnings.simplefilter("error", explore.NothingFeasibleWarning)
        try:
            results: explore.Results = explore.sweep(study, folder / "results.h5", workers=1, keep="all")
        except explore.FailedBlocksWarning as warning:
            reasons: dict[int, str] = warning.failures
            raise RuntimeError(f"{len(reasons)} blocks failed") from warning
    table: pd.DataFrame = explore.read_results(results.path, columns=["cv", "feasible"])
    assert len(table) == len(explore.open_results(results.path).to_pandas()) == study.space.n_designs
    assert set(explore.in_words(explore.rank(results))["status"]) == {"ok"}
    assert explore.xarray(results)["cv"].attrs["units"] == "1"
    refined: explore.Results = explore.refine(results, folder / "refined.h5", evaluations=256, seed=1, workers=1)
    assert refined.objectives == results.objectives
    polished: pd.DataFrame = explore.polish(refined, objective="cv")
    assert polished["cv"].iloc[0] <= explore.rank(refined)["cv"].min()
    certified: pd.DataFrame = explore.certify(refined, 0)
    assert certified["verdict"].to_list() == ["proved"]
    return results


def choose_design(results: explore.Results) -> dict[str, float]:
    """The steadiest design, evaluated and simulated on its own."""
    near: pd.DataFrame = explore.nearest(results, 3, where="crank > 60")
    assert near["violation"].is_monotonic_increasing
    front: pd.DataFrame = explore.rank(results, objectives=["cv", "rocker_acceleration_max"], fronts=1)
    best = front.iloc[0]
    design = {name: float(best[name]) for name in ("crank", "coupler", "rocker", "ground", "speed")}
    name: str = next(iter(explore.list_mechanisms()))
    row: pd.DataFrame = explore.evaluate(name, {**design, "speed": "40 rpm"}, metrics="cv", window=results.window)
    assert abs(row["cv"].iloc[0] - best["cv"]) < 1e-9
    arrays = explore.evaluate(name, design, metrics=["cv"], window=results.window, table=False)
    assert abs(float(arrays["cv"][0]) - best["cv"]) < 1e-9
    motion: pd.DataFrame = explore.simulate("crank-rocker", design, angles=72, method="closed-form")
    units: dict[str, str] = motion.attrs["units"]
    assert units["rocker_velocity"] == "rad/s"
    return design


def use_linkage(folder: Path) -> pd.DataFrame:
    """A slider-crank as a table: read, swept as a study, and evaluated."""
    linkage = explore.Linkage(
        {
            "driver": "crank",
            "frame": {"O": [0, 0]},
            "links": {"crank": {"O": 0, "A": "r"}, "rod": {"A": 0, "B": "l"}},
            "slots": {"guide": {"pin": "B", "link": "frame", "along": ["O", [1, 0]]}},
            "branch": {"B": "far"},
        }
    )
    (folder / "linkage.toml").write_text(linkage.to_toml(), encoding="utf-8")
    same: explore.Linkage = explore.load_linkage(folder / "linkage.toml")
    study = explore.Study(mechanism=same, parameters={"r": [20, 30], "l": 100}, metrics=["guide_velocity_peak"])
    assert study.linkage == linkage
    return explore.evaluate(linkage, {"r": [20, 30], "l": 100}, metrics=["guide_velocity_peak"])


def tune_design(design: dict[str, float]) -> explore.Tuning:
    """The cranks with which the steadiest design swings by 20 to 30 deg."""
    tuning: explore.Tuning = explore.tune(
        "crank-rocker", design, parameter="crank", metric="swing_angle", low=20, high="30 deg", also=["cv"]
    )
    first: float = tuning.intervals[0].start.parameter
    assert first < tuning.intervals[0].stop.parameter
    return tuning


def export_design(results: explore.Results, design: dict[str, float], folder: Path) -> None:
    """The best design as a study, and the same as a drawing from its parameters."""
    explore.export(results, [folder / "best.toml", folder / "best.csv"])
    assert explore.load_study(folder / "best.toml").space.n_designs == 1
    explore.export("crank-rocker", str(folder / "best.dxf"), parameters=design, points={"knife": (100, "4 cm")})


def apportion(results: explore.Results) -> pd.DataFrame:
    """Which parameters decide on the feasibility, and on the cv of feasible designs."""
    table: pd.DataFrame = explore.sensitivity(results, ["cv"], evaluations=20_000, seed=1)
    notes: list[str] = table.attrs["notes"]
    assert all(isinstance(note, str) for note in notes)
    return table


def tolerance_designs(results: explore.Results) -> explore.Robustness:
    """What a tenth of a millimetre does to the designs of the front."""
    robustness: explore.Robustness = explore.tolerance(results, {"crank": "0.1 mm", "rocker": 0.1}, draws=1000)
    yields: pd.Series[float] = robustness.designs["yield"]
    assert yields.between(0, 1).all()
    return robustness


def draw_charts(
    results: explore.Results,
    found: explore.Results,
    cover: explore.Coverage,
    tuning: explore.Tuning,
    robustness: explore.Robustness,
) -> list[Figure]:
    """Every figure of the results, which may be their path, and of the linkages found for a task."""
    refined = results.path.with_name("refined.h5")
    return [
        charts.pareto_chart(str(results.path), x="cv", y="rocker_acceleration_max"),
        charts.joint_pareto_chart([results, str(refined)], x="cv", y="rocker_acceleration_max"),
        charts.map_chart(results.path, x="crank", y="ground", metric="cv"),
        charts.parallel_chart(results.path),
        charts.motion_chart(results.path),
        charts.mechanism_chart(results.path),
        charts.path_chart(found.path),
        charts.cognates_chart(found),
        charts.burmester_chart(found),
        charts.ratio_chart(results.path),
        charts.coverage_chart(cover),
        charts.tuning_chart(tuning),
        charts.sensitivity_chart(apportion(results)),
        charts.tolerance_chart(robustness),
    ]


def find_linkages(folder: Path) -> explore.Results:
    """Linkages that carry a body through four poses, best first."""
    path = folder / "poses.toml"
    poses = [[12.06, 13.06, 37.7], [10.46, 16.81, 29.3], [5.8, 18.66, 23.6], [-0.54, 16.74, 21.8]]
    path.write_text(f'task = "motion"\n[target]\nposes = {poses}\n', encoding="utf-8")
    found: explore.Results = explore.synthesize(explore.load_task(path), folder / "poses.h5")
    assert found.attributes["sampler"] == "synthesis"
    return found


def refused(found: explore.Results) -> list[explore.ExploreError]:
    """One error of each kind that needs no cluster."""
    errors: list[explore.ExploreError] = []
    lengths = {"crank": 100.0, "coupler": 1000.0, "rocker": 500.0, "ground": 700.0}
    try:
        explore.Study(mechanism="crank-rocker", parameters={"crank": -1})
    except explore.ConfigError as error:
        problems: list[str] = error.problems
        assert len(problems) == 2
        errors.append(error)
    try:
        explore.evaluate("crank-rocker", lengths, metrics=["cvv"])
    except explore.RequestError as error:
        errors.append(error)
    try:
        charts.dwell_chart(found)  # these linkages have no slider
    except explore.RequestError as error:
        errors.append(error)
    try:
        explore.simulate("crank-rocker", {**lengths, "crank": 400.0})
    except explore.MotionError as error:
        errors.append(error)
    try:
        explore.Service("http://127.0.0.1:9", "token").jobs()
    except explore.ServiceError as error:
        errors.append(error)
    try:
        explore.open_results("nowhere.h5")
    except (explore.ResultsError, explore.ClusterError) as error:
        errors.append(error)
    return errors


def main(folder: Path) -> None:
    """Use every public name once."""
    print(explore.__version__)
    study = build_study()
    results = sweep_study(study, folder)
    design = choose_design(results)
    cover: explore.Coverage = explore.coverage(
        [13.58, 37.0], rocker=595.0, ground=751.0, coupler=(460.0, 1271.5), transmission_angle=(30.0, 150.0)
    )
    export_design(results, design, folder)
    assert len(use_linkage(folder)) == 2
    found = find_linkages(folder)
    figures = draw_charts(results, found, cover, tune_design(design), tolerance_designs(results))
    print(study, design, cover.gaps, len(figures), *refused(found), sep="\n")


if __name__ == "__main__":
    main(Path())
