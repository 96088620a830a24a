"""The command `explore` and its subcommands, each declared in its module of `explore.cli.commands`."""

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from explore._version import __version__
from explore.cli.commands.atlas import atlas
from explore.cli.commands.certify import certify
from explore.cli.commands.coverage import coverage
from explore.cli.commands.export import export
from explore.cli.commands.init import init
from explore.cli.commands.jobs import jobs
from explore.cli.commands.mechanisms import mechanisms
from explore.cli.commands.pack import pack
from explore.cli.commands.plot import plot
from explore.cli.commands.polish import polish
from explore.cli.commands.precision import precision
from explore.cli.commands.rank import rank
from explore.cli.commands.refine import refine
from explore.cli.commands.report import report
from explore.cli.commands.sensitivity import sensitivity
from explore.cli.commands.serve import serve
from explore.cli.commands.show import show
from explore.cli.commands.simulate import simulate
from explore.cli.commands.stability import stability
from explore.cli.commands.submit import submit
from explore.cli.commands.sweep import sweep
from explore.cli.commands.synthesize import synthesize
from explore.cli.commands.tolerance import tolerance
from explore.cli.commands.tune import tune
from explore.cli.commands.verify import verify


class _Commands(TyperGroup):
    """The commands; their help shows no placeholder for a value after a flag."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The options of `explore` itself."""
        return _without_flag_placeholders(super().get_params(ctx))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by name."""
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            _without_flag_placeholders(command.get_params(ctx))
        return command


def _without_flag_placeholders(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


app = typer.Typer(
    name="explore",
    cls=_Commands,
    help="Sweep the dimensions of mechanisms, simulate every design exactly, keep and rank the results.",
    epilog="Exit codes: 0 done, 1 failed, 2 wrong usage or study, 3 done but some blocks failed, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(requested: bool) -> None:
    if requested:
        typer.echo(f"explore {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


# The help lists the commands in this order.
app.command(epilog="Example: explore sweep configs/grid.toml")(sweep)
app.command(epilog="Example: explore synthesize task.toml, after explore init --task dead-positions")(synthesize)
app.command(epilog="Example: explore atlas --count 1048576 -o curves.h5")(atlas)
app.command(epilog="Example: explore rank --metric cv --metric swing_angle:max --top 5")(rank)
app.command(epilog="Example: explore refine results/optimum.h5 --evaluations 1000000")(refine)
app.command(epilog="Example: explore polish results/optimum.h5 --metric cv")(polish)
app.command(
    epilog="Exit code 0 only if all is proved, 1 if something is refuted or open. Example: explore certify --design 42"
)(certify)
app.command(epilog="Example: explore show --design 42")(show)
app.command(epilog="Example: explore plot pareto results/grid.h5 --x cv --y swing_angle -o front.svg")(plot)
app.command(epilog="Example: explore report results/grid.h5 -o grid.html")(report)
app.command(epilog="Example: explore coverage configs/rig_coverage.toml -o coverage.svg")(coverage)
app.command(epilog="Example: explore verify results/grid.h5")(verify)
app.command(epilog="Example: explore pack results/grid.h5")(pack)
app.command(
    epilog="Example: explore simulate --mechanism crank-rocker --set crank=100 --set coupler=1083.4236 "
    "--set rocker=541.7118 --set ground=691.7118 -o motion.csv"
)(simulate)
app.command(
    epilog="Example: explore tune results/grid.h5 --design 42 --parameter crank --metric mean_output_ratio "
    "--from 0.02 --to 0.2 -o curve.svg"
)(tune)
app.command(epilog="Example: explore export results/grid.h5 --design 42 -o design.dxf -o design.gif")(export)
app.command(epilog="Example: explore sensitivity results/optimum.h5 --metric cv -o sensitivity.svg")(sensitivity)
app.command(epilog="Example: explore tolerance results/grid.h5 --design 42 --tolerance crank=0.1 -o parts.svg")(
    tolerance
)
app.command(epilog="Example: explore precision smooth almost_change_point")(precision)
app.command(epilog="Example: explore stability --accuracy 1e-3")(stability)
app.command(epilog="Example: explore serve served")(serve)
app.command(epilog="Example: explore submit grid.toml --server http://127.0.0.1:8765 --token-file served/token")(submit)
app.command(epilog="Example: explore jobs grid --server http://127.0.0.1:8765 --token-file served/token --cancel")(jobs)
app.command(epilog="Example: explore mechanisms crank-rocker")(mechanisms)
app.command(epilog="Example: explore init my_study.toml")(init)
