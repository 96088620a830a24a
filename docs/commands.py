"""The page of the commands, made from their declarations when the site is built (``hooks.py``)."""

from enum import Enum

import typer

from explore.cli.application import app


def commands_page() -> str:
    """Markdown of the whole page."""
    group = typer.main.get_command(app)
    names = " · ".join(f"[{name}](#{name})" for name in group.commands)
    introduction = "`explore COMMAND --help` says the same as this page; `python -m explore` is the same as `explore`."
    completion = (
        "`explore --install-completion` lets the shell complete commands and options, mechanisms, kinds of figures, "
        "and the columns of the results that the line names, or of the newest."
    )
    parts = ["# Commands", names, introduction, completion, group.epilog]
    for name, command in group.commands.items():
        parts += [f"## {name}", command.help, option_table(command)]
        label, _, example = command.epilog.partition(": ")
        parts += [f"{label}:", f"```sh\n{example}\n```"]
    return "\n\n".join(parts) + "\n"


def option_table(command) -> str:
    """Markdown table of the arguments and options of a command."""
    rows = [f"| `explore {command.name}` | |", "|---|---|"]
    for parameter in command.params:
        sentences = [parameter.help]
        if parameter.default not in (None, False):
            default = parameter.default
            sentences.append(f"Default: `{default.value if isinstance(default, Enum) else default}`.")
        rows.append(f"| {usage(parameter)} | {' '.join(sentences)} |")
    return "\n".join(rows)


def usage(parameter) -> str:
    """Markdown of an argument, such as `CONFIG`, or of an option with its value."""
    if parameter.param_type_name == "argument":
        return f"`{parameter.metavar}`"
    names = [f"`{name}`" for name in sorted(parameter.opts, key=len)]
    if not parameter.is_flag:
        names[-1] = f"{names[-1][:-1]} {parameter.metavar or '…'}`"
    return ", ".join(names)
