"""All commands and their options."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from explore._version import __version__

app = typer.Typer(
    name="explore",
    help="Sweep the dimensions of linkages, simulate every design exactly, keep and rank the results.",
    epilog="Exit codes: 0 done, 1 failed, 2 bad usage or config, 3 done but some blocks failed, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Results = Annotated[
    Path | None, typer.Argument(metavar="RESULTS", help="A results file; the newest results/*.h5 unless given.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


class Keep(StrEnum):
    """What a sweep keeps."""

    all = "all"
    front = "front"


def _version(value: bool) -> None:
    if value:
        typer.echo(f"explore {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


@app.command(epilog="Example: explore sweep configs/grid.toml")
def sweep(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="The study, a TOML file.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Results file; results/NAME.h5 unless given.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Threads, or with --processes processes; all processors unless given.")
    ] = None,
    processes: Annotated[bool, typer.Option("--processes", help="Work in processes, not in threads.")] = False,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Work on a dask cluster, such as tcp://host:8786.")
    ] = None,
    keep: Annotated[Keep, typer.Option(help="Keep every design, or only the Pareto set.")] = Keep.all,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would be computed, and compute nothing.")
    ] = False,
    restart: Annotated[bool, typer.Option("--restart", help="Move existing results aside and start over.")] = False,
    max_failures: Annotated[
        int | None, typer.Option(min=0, help="Stop when more blocks than this have failed.")
    ] = None,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first block that fails.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show the log as it is written.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but what went wrong.")] = False,
) -> None:
    """Compute every design of a study; the same command again continues."""
    from explore.cli.sweeps import SweepOptions, run_sweep

    failures = 0 if fail_fast else max_failures
    options = SweepOptions(
        config=config,
        output=output,
        workers=workers,
        processes=processes,
        scheduler=scheduler,
        keep=keep.value,
        restart=restart,
        max_failures=failures,
        verbose=verbose,
        quiet=quiet,
    )
    raise typer.Exit(run_sweep(options, dry_run=dry_run))


@app.command(epilog="Example: explore rank --metric cv --metric swing_angle:max --top 5")
def rank(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RESULTS",
            help="Results files, several of them ranked together; the newest results/*.h5 unless given.",
        ),
    ] = None,
    metric: Annotated[
        list[str] | None,
        typer.Option(help="NAME, NAME:min or NAME:max. One orders the Pareto set, several are its objectives."),
    ] = None,
    where: Annotated[
        str | None, typer.Option(metavar="CONDITION", help='Only these, such as "swing_angle > 20 and not cv >= 0.5".')
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(help="A constraint narrower than the sweep's: METRIC=VALUE, METRIC>=VALUE or METRIC<=VALUE."),
    ] = None,
    fronts: Annotated[
        int, typer.Option(min=1, metavar="K", help="How many fronts; the second is the first without it.")
    ] = 1,
    quality: Annotated[
        bool, typer.Option("--quality", help="Also the knee, crowding distance and share of the hypervolume.")
    ] = False,
    top: Annotated[
        int | None, typer.Option(min=0, help="Lines to print, 0 for all; usually 10, with --json all.")
    ] = None,
    json: Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Also write the Pareto set, as .csv, .json, .md or .parquet.")
    ] = None,
) -> None:
    """Choose the Pareto-optimal designs, best first."""
    from explore.cli.ranks import RankOptions, print_ranking

    options = RankOptions(
        results=results or [],
        metrics=metric or [],
        fronts=fronts,
        where=where,
        limits=limit or [],
        quality=quality,
        top=top,
        output=output,
    )
    print_ranking(options, as_json=json)


@app.command(epilog="Example: explore show --design 42")
def show(
    results: Results = None,
    design: Annotated[int | None, typer.Option(help="Show this design, by its number.")] = None,
    json: Json = False,
) -> None:
    """Show what is in a results file, or one design in full."""
    from explore.cli.shows import show_design, show_results

    if design is None:
        show_results(results, as_json=json)
    else:
        show_design(results, design, as_json=json)


@app.command(epilog="Example: explore plot pareto results/grid.h5 --x cv --y swing_angle -o front.svg")
def plot(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="pareto, motion, mechanism, map, parallel or ratio.")],
    results: Results = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="FILE.png, .svg or .pdf; results/NAME-KIND.png unless given."),
    ] = None,
    x: Annotated[str | None, typer.Option(metavar="COLUMN", help="What runs to the right.")] = None,
    y: Annotated[str | None, typer.Option(metavar="COLUMN", help="What runs upwards.")] = None,
    metric: Annotated[str | None, typer.Option(metavar="COLUMN", help="What is shown in colours.")] = None,
    design: Annotated[
        int | None, typer.Option(min=0, help="The design that matters; the best of the Pareto set unless given.")
    ] = None,
) -> None:
    """Draw a figure of the results and print the name of its file."""
    from explore.cli.plots import PlotOptions, plot_results

    plot_results(kind, results, output, PlotOptions(x=x, y=y, metric=metric, design=design))


@app.command(epilog="Example: explore report results/grid.h5 -o grid.html")
def report(
    results: Results = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="FILE.html; results/NAME-report.html unless given.")
    ] = None,
) -> None:
    """Write the results as one interactive page for a browser, and print its name."""
    from explore.cli.reports import write_report

    write_report(results, output)


@app.command(epilog="Example: explore coverage configs/rig_coverage.toml -o coverage.svg")
def coverage(
    config: Annotated[
        Path, typer.Argument(metavar="CONFIG", help="A study: its cranks, the range of its coupler, its bounds.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Also draw it: FILE.png, .svg or .pdf.")] = None,
    json: Json = False,
) -> None:
    """Show which swings exchangeable cranks reach over the travel of the coupler, their overlaps and gaps."""
    from explore.cli.coverages import print_coverage

    print_coverage(config, output, as_json=json)


@app.command(epilog="Example: explore verify results/grid.h5")
def verify(results: Results = None, json: Json = False) -> None:
    """Check every committed block of a results file against its checksum."""
    from explore.cli.verifications import verify_results

    raise typer.Exit(verify_results(results, as_json=json))


@app.command(epilog="Example: explore pack results/grid.h5")
def pack(
    results: Results = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The copy; NAME.packed.h5 beside the results unless given.")
    ] = None,
) -> None:
    """Write a compressed copy of finished results, which every command reads alike."""
    from explore.cli.packs import pack_results

    pack_results(results, output)


@app.command(
    epilog="Example: explore simulate --mechanism crank-rocker --set crank=100 --set coupler=1083.4236 "
    "--set rocker=541.7118 --set ground=691.7118 -o motion.csv"
)
def simulate(
    config: Annotated[Path | None, typer.Argument(metavar="CONFIG", help="A study: one design of it.")] = None,
    mechanism: Annotated[str | None, typer.Option(help="A mechanism, with --set in place of a study.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A parameter, in place of the study's; a unit may follow."),
    ] = None,
    design: Annotated[int, typer.Option(min=0, help="Which design of the study.")] = 0,
    angles: Annotated[int, typer.Option(min=1, help="How many equispaced crank angles.")] = 360,
    method: Annotated[
        str, typer.Option(help="How to solve it: auto, newton, rk45 …; `explore precision` compares them.")
    ] = "auto",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The file, CSV unless it ends in .json; stdout unless given.")
    ] = None,
    json: Json = False,
) -> None:
    """Print the motion of one design over a turn: angles, velocities, accelerations."""
    from explore.cli.motions import print_motion

    print_motion(config, mechanism, set_ or [], design, angles, method, output, as_json=json)


@app.command(epilog="Example: explore precision smooth almost_change_point")
def precision(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE", help="Names of bundled scenes, or .toml files; all bundled ones unless given."),
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="The folder for tables and charts.")] = Path(
        "results/precision"
    ),
    json: Json = False,
) -> None:
    """Chart what each way of solving the motion costs against how wrong it is."""
    from explore.cli.precisions import compare_precision

    compare_precision(scenes or [], output, as_json=json)


@app.command(epilog="Example: explore stability --accuracy 1e-3")
def stability(
    output: Annotated[Path, typer.Option("-o", "--output", help="The folder for tables and charts.")] = Path(
        "results/stability"
    ),
    accuracy: Annotated[
        float, typer.Option(min=1e-14, max=0.1, help="Largest error of a motion that counts as right.")
    ] = 1e-6,
    json: Json = False,
) -> None:
    """Map how near to the change point each way of solving the motion may be trusted."""
    from explore.cli.stabilities import map_methods

    map_methods(output, accuracy, as_json=json)


@app.command(epilog="Example: explore mechanisms crank-rocker")
def mechanisms(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="One mechanism in full.")] = None,
    json: Json = False,
) -> None:
    """List the mechanisms with their parameters, signals, metrics and windows."""
    from explore.cli.listings import print_mechanism, print_mechanisms

    if name is None:
        print_mechanisms(as_json=json)
    else:
        print_mechanism(name, as_json=json)


@app.command(epilog="Example: explore init my_study.toml")
def init(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="The file to write.")] = Path("study.toml"),
    mechanism: Annotated[str, typer.Option(help="The mechanism.")] = "crank-rocker",
) -> None:
    """Write a commented study that runs, to start from."""
    from explore.cli.starters import write_starter

    write_starter(config, mechanism)
