"""Make the pictures of the documentation from real runs: ``python docs/figures.py`` in the repository's root.

Needs the results of ``explore sweep`` of configs/grid.toml, optimum.toml, published.toml, slider_crank.toml,
variable_crank.toml, straight_line.toml, rig_20deg.toml, of wiper.toml in docs/tutorials.md and of shaper.toml in
docs/linkages.md, of
``explore synthesize`` with the tasks that ``explore init NAME.toml --task NAME`` writes of path, motion and dwell, and
those of ``explore precision`` and of ``explore stability`` with crank-rocker, with variable-crank and with gears.
"""

import io
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from PIL import Image

import explore
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.comparison.stability import declared_case
from explore.figures.charts.averages import averages_chart
from explore.figures.charts.mechanism import draw_mechanism
from explore.figures.charts.pareto import draw_designs
from explore.figures.charts.precision import overview_chart, scene_chart
from explore.figures.charts.stability import stability_chart, starts_chart, turn_chart
from explore.figures.charts.style import BLUE, INK, ORANGE, new_figure, save_figure
from explore.figures.simulation import simulate_design

mpl.use("Agg")
HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "benchmarks"))


def draw_first_study() -> None:
    """The designs of the first study, their Pareto set, and the steadiest linkage in both limit positions."""
    results = explore.open_results("results/grid.h5")
    figure = new_figure(11.5, 5.6)
    chart, sketch = figure.subplots(1, 2, width_ratios=[1.15, 1])
    ranking = draw_designs(figure, chart, results)
    simulated = simulate_design(results, int(ranking.frame.index[0]))
    draw_mechanism(sketch, simulated)
    chart.set_ylabel(chart.get_ylabel().replace(", ", ",\n"))
    chart.set_title(f"{results.n_designs:,} designs")
    sketch.set_title("the steadiest, in both limit positions")
    for axes in (chart, sketch):
        placement = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14)}
        axes.legend(**placement, frameon=False, fontsize=9, handlelength=3.0)
    save_figure(figure, HERE / "first_study.png")
    compress(HERE / "first_study.png")


def draw_nodes() -> None:
    """Nodes per design against the Grashof margin, and equispaced samples of the same accuracy."""
    from nodes import TOLERANCE, measure

    margins, stroke_nodes, turn_nodes, samples, _ = np.array(list(measure())).T
    figure, chart = plt.subplots(figsize=(7, 3.8), layout="constrained")
    chart.loglog(margins, samples, "^--", color=ORANGE, mfc="white", label="equispaced samples of the turn")
    chart.loglog(margins, turn_nodes, "o-", color=BLUE, label="nodes of the turn")
    chart.loglog(margins, stroke_nodes, "s-", color=INK, mfc="white", label="nodes of the drive stroke")
    chart.invert_xaxis()
    chart.set_xlabel("Grashof margin over longest link (towards the change point: right)")
    chart.set_ylabel("evaluations of the motion")
    chart.set_title(f"variance of the rocker velocity to {TOLERANCE:.0e}", fontsize=10)
    chart.legend(loc="upper left", frameon=False)
    chart.spines[["top", "right"]].set_visible(False)
    figure.savefig(HERE / "nodes.png", dpi=110)


def draw_comparisons() -> None:
    """The charts of ``explore precision`` and ``explore stability``, from their tables, at a size for a page."""
    motions, averages = (pd.read_csv(f"results/precision/{name}.csv") for name in ("motions", "averages"))
    verdicts, turns = (pd.read_csv(f"results/stability-variable-crank/{name}.csv") for name in ("map", "turn"))
    change_point = pd.read_csv("results/stability-crank-rocker/map.csv")
    gears = (pd.read_csv(f"results/stability-gears/{name}.csv") for name in ("starts", "counts"))
    four_bar, slicer = declared_case("crank-rocker"), declared_case("variable-crank")
    angles = [float(np.rad2deg(angle)) for angle in slicer.singular_angles]
    scenes = [load_scene(path) for path in bundled_scenes().values()]
    titles = {scene.name: scene.title for scene in scenes}
    four_bars = {scene.name: scene.title for scene in scenes if scene.designs.loop.name == "crank-rocker"}
    sliders = {name: title for name, title in titles.items() if name not in four_bars}
    smooth = next(scene for scene in scenes if scene.name == "smooth")
    charts = {
        "precision": overview_chart(motions[motions["scene"].isin(four_bars)], four_bars),
        "precision-sliders": overview_chart(motions[motions["scene"].isin(sliders)], sliders),
        "smooth": scene_chart(motions[motions["scene"] == "smooth"], f"{smooth.title}: {smooth.question}"),
        "averages": averages_chart(averages, titles),
        "stability": stability_chart(change_point, 1e-6, four_bar.distance, four_bar.beyond),
        "variable-crank-stability": stability_chart(verdicts, 1e-6, slicer.distance, slicer.beyond),
        "gears-starts": starts_chart(*gears),
        "variable-crank-turn": turn_chart(turns, angles, "variable-crank, every method at its finest setting"),
    }
    for name, figure in charts.items():
        with io.BytesIO() as buffer:
            figure.savefig(buffer, dpi=120)
            # the charts have few colours: a palette reduces the file to a third
            indexed = Image.open(buffer).convert("RGB").quantize(256, dither=Image.Dither.NONE)
            indexed.save(HERE / f"{name}.png", optimize=True)


#: Largest size of a picture, bytes.
MAX_BYTES = 150_000
#: Arguments of ``explore plot`` for each picture of the gallery.
GALLERY = {
    "pareto": ["pareto", "results/grid.h5"],
    "pareto-density": ["pareto", "results/optimum.h5"],
    "map": ["map", "results/grid.h5"],
    "map-drawn": ["map", "results/optimum.h5", "--x", "rocker", "--y", "ground"],
    "parallel": ["parallel", "results/grid.h5"],
    "motion": ["motion", "results/grid.h5"],
    "mechanism": ["mechanism", "results/grid.h5"],
    "path": ["path", "results/path.h5"],
    "cognates": ["cognates", "results/path.h5"],
    "burmester": ["burmester", "results/motion.h5"],
    "dwell": ["dwell", "results/dwell.h5"],
    "ratio": ["ratio", "results/grid.h5", "--design", "156168"],
}
#: Arguments of ``explore plot`` for the picture of the tutorial, the motion of the chosen design.
TUTORIAL = ["motion", "results/optimum.h5", "--design", "22418"]
#: Commands for the pictures of the pages ``slider-crank``, ``test-rig``, ``ranking``, ``sensitivity``, ``tune`` and
#: ``variable-crank``.
PAGES = {
    "slider-crank-pareto": "plot pareto results/slider_crank.h5 --x cv --y time_ratio",
    "rig-pareto": "plot pareto results/rig_20deg.h5 --x pin_force_peak --y velocity_thd --design 28",
    "rig-coverage": "coverage configs/rig_coverage.toml",
    "variable-crank": "plot motion results/variable_crank.h5 --design 0",
    "linkages": "plot mechanism results/shaper.h5 --design 163",
    "nearest": "plot map results/wiper.h5 --x rocker --y crank",
    "sensitivity": "sensitivity results/optimum.h5",
    "tune": "tune --mechanism crank-rocker --set crank=50 --set coupler=940.62 --set rocker=211.79 --set ground=869.44 "
    "--parameter crank --metric mean_output_ratio --metric cv --metric transmission_angle_min --from 0.02 --to 0.2",
}


#: Arguments for the pictures of ``export.md``, which are files of the design itself.
EXPORTED = ["export", "results/straight_line.h5"]


def draw_exported() -> None:
    """The pictures of ``export.md``."""
    outputs = [part for ending in (".svg", ".animated.svg") for part in ("-o", str(HERE / f"export{ending}"))]
    subprocess.run([sys.executable, "-m", "explore", *EXPORTED, *outputs], check=True)


def draw_gallery() -> None:
    """The pictures of ``gallery.md``, ``tutorial.md`` and of the pages on mechanisms but ``gears.md``."""
    commands = {HERE / "gallery" / f"{name}.png": ["plot", *arguments] for name, arguments in GALLERY.items()}
    commands[HERE / "tutorial-motion.png"] = ["plot", *TUTORIAL]
    commands |= {HERE / f"{name}.png": command.split() for name, command in PAGES.items()}
    for output, arguments in commands.items():
        subprocess.run([sys.executable, "-m", "explore", *arguments, "-o", str(output)], check=True)
        compress(output)


def compress(path: Path) -> None:
    """Reduce a picture to 128 colours and, if it is still too large, to 900 pixels in width."""
    picture = Image.open(path).convert("RGB")
    for width in (picture.width, 900):
        scaled = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
        # MEDIANCUT drops rare colours, such as the one green star; MAXCOVERAGE keeps them, and kmeans then corrects
        # the frequent ones, such as a pale grey
        palette = Image.Quantize.MAXCOVERAGE
        scaled.quantize(128, palette, kmeans=1, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= MAX_BYTES:
            return


if __name__ == "__main__":
    draw_first_study()
    draw_nodes()
    draw_comparisons()
    draw_gallery()
    draw_exported()
