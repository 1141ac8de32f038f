"""The page of the command line, from the commands themselves."""

from textwrap import dedent
from typing import Any

from frobs_cli.program import walk
from generate.rst import code, escape, heading, label, literal, table


def parameters(command: Any) -> list[tuple[str, str, str]]:
    """Return name, default and help of each argument and option of a command."""
    rows = []
    for parameter in command.params:
        if parameter.name == "help" or getattr(parameter, "hidden", False):
            continue
        is_option = parameter.param_type_name == "option"
        name = ", ".join([*parameter.opts, *parameter.secondary_opts]) if is_option else parameter.name.upper()
        if is_option and parameter.metavar:
            name += f" {parameter.metavar}"
        elif parameter.metavar:
            name = parameter.metavar
        rows.append((name, _default(parameter), getattr(parameter, "help", None) or ""))
    return rows


def _default(parameter: Any) -> str:
    """Return what a parameter is where it is not given: in words where the command gives words."""
    shown = getattr(parameter, "show_default", None)
    if isinstance(shown, str):
        return shown
    if shown is False or parameter.default is None or parameter.default is False or callable(parameter.default):
        return ""
    return str(parameter.default)


def page() -> str:
    """Return the page."""
    found = list(walk())
    text = label("commands") + heading("Command line")
    text += (
        "All functions are subcommands of ``frobs``. Results are printed on stdout, and all other messages on stderr; "
        "``--json`` prints the results as JSON. The exit code is 0 on success, 1 if a check failed, 2 for invalid input, "
        "130 after Ctrl-C, and 143 if SIGTERM ended a training run.\n\n"
    )
    rows = [(f":ref:`{name} <{_label(name)}>`", escape(_parts(command)[0])) for name, command in found[1:]]
    text += table(["command", "what it does"], rows, widths="25 75")
    return text + "".join(_section(name, command) for name, command in found)


def _label(name: str) -> str:
    return name.replace(" ", "-") + "-command"


def _parts(command: Any) -> tuple[str, str, str]:
    """Return the first paragraph of a command's help, the rest of it, and its examples."""
    text, _, example = (command.help or "").partition("Example:\n")
    first, _, rest = text.strip().partition("\n\n")
    return " ".join(first.split()), rest.strip(), dedent(example).strip()


def _section(name: str, command: Any) -> str:
    first, rest, example = _parts(command)
    arguments = [row for row in parameters(command) if row[0].isupper()]
    usage = " ".join([name, *(row[0] for row in arguments), "[OPTIONS]"])
    if hasattr(command, "commands"):
        usage = f"{name} COMMAND"
    text = label(_label(name)) + heading(name, "-") + f"{escape(first)}\n\n"
    text += f"{escape(rest)}\n\n" if rest else ""
    text += literal(usage) + (literal(example, "console") if example else "")
    rows = [(code(what), escape(help), code(default)) for what, default, help in parameters(command)]
    return text + (table(["argument or option", "meaning", "default"], rows, widths="30 50 20") if rows else "")
