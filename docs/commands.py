"""Write ``cli.md``, the page of the commands, from their declarations: ``python docs/commands.py``."""

from enum import Enum
from pathlib import Path

import typer

from explore.cli.application import app

PAGE = Path(__file__).parent / "cli.md"


def page() -> str:
    group = typer.main.get_command(app)
    names = " · ".join(f"[{name}](#{name})" for name in group.commands)
    start = "`explore COMMAND --help` says the same as this page, which `python docs/commands.py` writes."
    parts = ["# Commands", names, start, group.epilog]
    for name, command in group.commands.items():
        parts += [f"## {name}", command.help, table(command)]
        label, _, example = command.epilog.partition(": ")
        parts += [f"{label}:", f"```sh\n{example}\n```"]
    return "\n\n".join(parts) + "\n"


def table(command) -> str:
    rows = [f"| `explore {command.name}` | |", "|---|---|"]
    for parameter in command.params:
        values = [parameter.help]
        if parameter.default not in (None, False):
            default = parameter.default
            values.append(f"Default: `{default.value if isinstance(default, Enum) else default}`.")
        rows.append(f"| {spelling(parameter)} | {' '.join(values)} |")
    return "\n".join(rows)


def spelling(parameter) -> str:
    """How it is typed: CONFIG, or `-o`, `--output` with what follows."""
    if parameter.param_type_name == "argument":
        return f"`{parameter.metavar}`"
    names = [f"`{name}`" for name in sorted(parameter.opts, key=len)]
    if not parameter.is_flag:
        names[-1] = f"{names[-1][:-1]} {parameter.metavar or '…'}`"
    return ", ".join(names)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
