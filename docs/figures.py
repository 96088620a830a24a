"""Make the pictures of the documentation from real runs: ``python docs/figures.py`` in the repository's root.

Needs the results of ``explore sweep`` of configs/grid.toml, optimum.toml, published.toml and rig_20deg.toml, and
those of ``explore precision`` and ``explore stability``.
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
from explore.charts.averages import averages_chart
from explore.charts.precision import overview_chart, scene_chart
from explore.charts.stability import stability_chart
from explore.comparison.scenes import bundled_scenes, load_scene

mpl.use("Agg")
HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "benchmarks"))
INK, FRONT, CHOSEN, MUTED = "#222222", "#0b6e4f", "#c8102e", "#9aa5b1"


def first_study() -> None:
    """The designs of the first study, their Pareto set, and the steadiest linkage in both limit positions."""
    table = explore.read_results("results/grid.h5")
    best = explore.rank("results/grid.h5", order_by="cv")
    feasible = table[table["feasible"]]
    chosen = best.iloc[0]

    figure, (chart, sketch) = plt.subplots(1, 2, figsize=(10, 4.2), width_ratios=[1.25, 1], layout="constrained")
    chart.plot(feasible["rocker_acceleration_max"], feasible["cv"], ".", color=MUTED, ms=1.5, rasterized=True)
    points = chart.scatter(
        best["rocker_acceleration_max"], best["cv"], c=best["transmission_angle_min"], s=16, cmap="viridis"
    )
    chart.plot(
        chosen["rocker_acceleration_max"], chosen["cv"], "*", color=CHOSEN, ms=13, label=f"design {best.index[0]:,}"
    )
    chart.set_xlabel("largest rocker acceleration [rad/s²]")
    chart.set_ylabel("coefficient of variation of the output [1]")
    chart.set_title(
        f"{len(best):,} Pareto-optimal of {len(feasible):,} feasible of {len(table):,} designs", fontsize=10
    )
    chart.legend(loc="upper right", frameon=False)
    figure.colorbar(points, ax=chart, label="smallest transmission angle [deg]")
    draw_linkage(sketch, chosen)
    figure.savefig(HERE / "first_study.png", dpi=130)


def draw_linkage(axes: plt.Axes, design) -> None:
    """The linkage in true proportions: both limit positions and the circle and arc of the joints."""
    lengths = {name: float(design[name]) for name in ("crank", "coupler", "rocker", "ground")}
    motion = explore.simulate("crank-rocker", **lengths, angles=720)
    rocker = np.deg2rad(motion["rocker_angle"].to_numpy())
    crank = np.deg2rad(motion.index.to_numpy())
    pin = np.column_stack([np.cos(crank), np.sin(crank)]) * lengths["crank"]
    joint = np.column_stack(
        [lengths["ground"] + lengths["rocker"] * np.cos(rocker), lengths["rocker"] * np.sin(rocker)]
    )
    axes.plot(*pin.T, color=MUTED, lw=1)
    axes.plot(*joint.T, color=MUTED, lw=3, alpha=0.5)
    for index, style, label in ((rocker.argmax(), "-", "coupler over crank"), (rocker.argmin(), "--", "in line")):
        chain = np.array([[0, 0], pin[index], joint[index], [lengths["ground"], 0]])
        axes.plot(*chain.T, style, color=FRONT, lw=2, marker="o", ms=4, mfc="white", label=label)
    axes.plot([0, lengths["ground"]], [0, 0], color=INK, lw=1)
    axes.plot([0, lengths["ground"]], [0, 0], "^", color=INK, ms=8)
    axes.set_aspect("equal")
    axes.set_xlabel("mm")
    axes.set_title("the steadiest: its two limit positions", fontsize=10)
    axes.legend(loc="lower right", fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


def nodes() -> None:
    """Nodes that a design needs against its Grashof margin, beside equispaced samples of the same accuracy."""
    from nodes import TOLERANCE, measured

    shares, stroke, turn, needed, _ = np.array(list(measured())).T
    figure, chart = plt.subplots(figsize=(7, 3.8), layout="constrained")
    chart.loglog(shares, needed, "^--", color=CHOSEN, mfc="white", label="equispaced samples of the turn")
    chart.loglog(shares, turn, "o-", color=FRONT, label="nodes of the turn")
    chart.loglog(shares, stroke, "s-", color=INK, mfc="white", label="nodes of the drive stroke")
    chart.invert_xaxis()
    chart.set_xlabel("Grashof margin over longest link (towards the change point: right)")
    chart.set_ylabel("evaluations of the motion")
    chart.set_title(f"variance of the rocker velocity to {TOLERANCE:.0e}", fontsize=10)
    chart.legend(loc="upper left", frameon=False)
    chart.spines[["top", "right"]].set_visible(False)
    figure.savefig(HERE / "nodes.png", dpi=110)


def methods() -> None:
    """The charts of both comparisons as those commands left their tables, at a size for a page."""
    motions, averages = (pd.read_csv(f"results/precision/{name}.csv") for name in ("motions", "averages"))
    judged = pd.read_csv("results/stability/map.csv")
    scenes = [load_scene(path) for path in bundled_scenes().values()]
    titles = {scene.name: scene.title for scene in scenes}
    smooth = next(scene for scene in scenes if scene.name == "smooth")
    charts = {
        "precision": overview_chart(motions, titles),
        "smooth": scene_chart(motions[motions["scene"] == "smooth"], f"{smooth.title}: {smooth.question}"),
        "averages": averages_chart(averages, titles),
        "stability": stability_chart(judged, 1e-6),
    }
    for name, figure in charts.items():
        with io.BytesIO() as drawn:
            figure.savefig(drawn, dpi=120)
            # flat colours: a palette makes the file a third
            flat = Image.open(drawn).convert("RGB").quantize(256, dither=Image.Dither.NONE)
            flat.save(HERE / f"{name}.png", optimize=True)


#: Bytes of a picture.
LARGEST = 150_000
#: Each picture of the gallery: the arguments of ``explore plot`` that make it.
GALLERY = {
    "pareto": ["pareto", "results/grid.h5"],
    "pareto-density": ["pareto", "results/optimum.h5"],
    "map": ["map", "results/grid.h5"],
    "map-drawn": ["map", "results/optimum.h5", "--x", "rocker", "--y", "ground"],
    "parallel": ["parallel", "results/grid.h5"],
    "motion": ["motion", "results/grid.h5"],
    "motion-published": ["motion", "results/published.h5", "--design", "0"],
    "mechanism": ["mechanism", "results/grid.h5"],
    "ratio": ["ratio", "results/grid.h5", "--design", "199041"],
}


#: That of the tutorial: the motion of the design that it chooses.
TUTORIAL = ["motion", "results/optimum.h5", "--design", "22418"]


#: Those of the page ``test-rig.md``: the published lengths among all of 20 deg, and the reach of the eccentrics.
RIG = {
    "rig-pareto": "plot pareto results/rig_20deg.h5 --x pin_force_peak --y velocity_thd --design 28",
    "rig-coverage": "coverage configs/rig_coverage.toml",
}


def plots() -> None:
    """The pictures of the pages ``gallery.md``, ``tutorial.md`` and ``test-rig.md``."""
    wanted = {HERE / "gallery" / f"{name}.png": ["plot", *arguments] for name, arguments in GALLERY.items()}
    wanted[HERE / "tutorial-motion.png"] = ["plot", *TUTORIAL]
    wanted |= {HERE / f"{name}.png": command.split() for name, command in RIG.items()}
    for output, arguments in wanted.items():
        subprocess.run([sys.executable, "-m", "explore", *arguments, "-o", str(output)], check=True)
        shrink(output)


def shrink(path: Path) -> None:
    """Fewer colours, and where that is not enough fewer pixels: pages are read over slow lines too."""
    picture = Image.open(path).convert("RGB")
    for width in (picture.width, 900):
        smaller = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
        # the usual palette follows the crowd: the one green star among blue rings would be blue; this one covers all
        # colours, and kmeans then moves it to those that are there: a pale grey would be green
        palette = Image.Quantize.MAXCOVERAGE
        smaller.quantize(128, palette, kmeans=1, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= LARGEST:
            return


if __name__ == "__main__":
    first_study()
    nodes()
    methods()
    plots()
