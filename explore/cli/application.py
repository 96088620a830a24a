"""The command `explore` and its subcommands, each declared in its module of `explore.cli.commands`."""

from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

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


class _Command(TyperCommand):
    """A command that refuses an option given several times of which only the last would count."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments."""
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        single = [p for p in given if isinstance(p, TyperOption) and not (p.multiple or p.is_flag)]
        repeated = next((option for option in single if single.count(option) > 1), None)
        if repeated is not None and not ctx.resilient_parsing:
            ctx.fail(f"{repeated.opts[-1]} is given several times; give it once")
        return super().parse_args(ctx, args)


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


#: Commands by what they are for, each with the last line of its help; the help lists them in this order.
_COMMANDS: dict[str, dict[Callable[..., Any], str]] = {
    "Make": {
        init: "Example: explore init my_study.toml",
        sweep: "Example: explore sweep configs/grid.toml",
        synthesize: "Example: explore synthesize task.toml, after explore init --task dead-positions",
        atlas: "Example: explore atlas --count 1048576 -o curves.h5",
    },
    "Look": {
        show: "Example: explore show --design 42",
        plot: "Example: explore plot pareto results/grid.h5 --x cv --y swing_angle -o front.svg",
        report: "Example: explore report results/grid.h5 -o grid.html",
        simulate: "Example: explore simulate --mechanism crank-rocker --set crank=100 --set coupler=1083.4236 "
        "--set rocker=541.7118 --set ground=691.7118 -o motion.csv",
        coverage: "Example: explore coverage configs/rig_coverage.toml -o coverage.svg",
        mechanisms: "Example: explore mechanisms crank-rocker",
    },
    "Choose": {
        rank: "Example: explore rank --metric cv --metric swing_angle:max --top 5",
    },
    "Improve": {
        refine: "Example: explore refine results/optimum.h5 --evaluations 1000000",
        polish: "Example: explore polish results/optimum.h5 --metric cv",
        tune: "Example: explore tune results/grid.h5 --design 42 --parameter crank --metric mean_output_ratio "
        "--from 0.02 --to 0.2 -o curve.svg",
    },
    "Prove": {
        certify: "Exit code 0 only if all is proved, 1 if something is refuted or open. "
        "Example: explore certify --design 42",
        tolerance: "Example: explore tolerance results/grid.h5 --design 42 --tolerance crank=0.1 -o parts.svg",
        sensitivity: "Example: explore sensitivity results/optimum.h5 --metric cv -o sensitivity.svg",
        verify: "Example: explore verify results/grid.h5",
        precision: "Example: explore precision smooth almost_change_point",
        stability: "Example: explore stability --accuracy 1e-3",
    },
    "Take away": {
        export: "Example: explore export results/grid.h5 --design 42 -o design.dxf -o design.gif",
        pack: "Example: explore pack results/grid.h5",
    },
    "Group": {
        serve: "Example: explore serve served",
        submit: "Example: explore submit grid.toml --server http://127.0.0.1:8765 --token-file served/token",
        jobs: "Example: explore jobs grid --server http://127.0.0.1:8765 --token-file served/token --cancel",
    },
}
for _panel, _commands in _COMMANDS.items():
    for _command, _epilog in _commands.items():
        app.command(cls=_Command, rich_help_panel=_panel, epilog=_epilog)(_command)
