"""A group of commands that handles errors, Ctrl-C and closed pipes."""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import traceback
from collections.abc import Collection, Sequence
from decimal import Decimal, InvalidOperation
from typing import Any, NoReturn, get_args

import typer
from typer.core import TyperCommand, TyperGroup

from frobs_cli.output import message, print_error, print_note, printable

BAD_INPUT = 2
INTERRUPTED = 130
_ERRORS = (
    ("frobs_core.util.errors", "FrobsError"),
    ("frobs_deploy.errors", "DeployError"),
    ("gymnasium.error", "Error"),
)
"""Modules and classes of errors that are reported as a single line. Modules that are not imported are ignored."""

READER_GONE = 141
"""Exit code that shells report for a program whose output pipe was closed (128 + SIGPIPE)."""


_MOST_DIGITS = 19
"""Maximum number of digits of a number in scientific notation, so that ``1e999999999`` does not use up the memory."""


class FrobsCommand(TyperCommand):
    """A command whose help shows no type for flags, and whose integer options accept ``1e5`` and ``1000.0``."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, including ``--help``."""
        return _without_types(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse ``args``, after writing whole numbers such as ``1e5`` as integers."""
        counts = {name: option.nargs for option in self.get_params(ctx) if _is_integer(option) for name in option.opts}
        written, left = [], 0
        for arg in args:
            written.append(_as_integer(arg, counts, is_value=left > 0))
            left = counts.get(arg, max(0, left - 1))
        return super().parse_args(ctx, written)


class FrobsGroup(TyperGroup):
    """A command group that reports each failure as a single line on stderr and through the exit code.

    The exit code is 0 for success, 2 for invalid input, 130 for Ctrl-C, and 143 for SIGTERM during training, after a
    checkpoint was written. The exit code is 1 if a check failed, if one of several jobs failed, or if a bug caused an
    exception, whose traceback is then printed.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, including ``--help``."""
        return _without_types(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command whose name is the first of ``args``.

        Raises:
            UnknownNameError: No command has this name. The message suggests the closest match.
        """
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            from frobs_core.plugins import install_command
            from frobs_core.util.errors import UnknownNameError

            hint = install_command("command", " ".join([*_words(ctx), args[0]]))
            raise UnknownNameError("command", args[0], self.list_commands(ctx), install_hint=hint)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command, and exit with a one-line message on Ctrl-C."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            print_note(f"interrupted{f': {interrupt}' if str(interrupt) else ''}")
            raise typer.Exit(getattr(interrupt, "exit_code", INTERRUPTED)) from None

    def passes_options_on(self, args: Sequence[str]) -> bool:
        """Return whether a command line, ``args``, ends with options that are passed to another program."""
        return False

    def main(self, args: Sequence[str] | None = None, *positional: Any, **keywords: Any) -> NoReturn:
        """Run the command line ``args``, by default that of the process, and exit the process."""
        given = list(sys.argv[1:] if args is None else args)
        debug = "--debug" in given or os.environ.get("FROBS_DEBUG", "0") not in ("", "0")
        keywords["standalone_mode"] = False
        _accept_any_encoding()
        if logging.lastResort is not None:  # the handler of messages that no library handles
            logging.lastResort.setFormatter(_PrintableFormatter())
        try:
            # --debug is accepted anywhere, so that users can append it to a failed command line
            if not self.passes_options_on(given):
                given = [arg for arg in given if arg != "--debug"]
            result = super().main(given, *positional, **keywords)
            sys.stdout.flush()  # report a closed pipe now, not when the interpreter shuts down
            code = result if isinstance(result, int) else 0
        except BrokenPipeError:
            _write_no_more()
            code = READER_GONE
        except typer.Abort:
            code = INTERRUPTED
        except Exception as error:
            if not isinstance(error, _reported()):
                raise
            if debug:
                sys.stderr.write(printable(traceback.format_exc()))
            print_error(_line(error))
            code = getattr(error, "command_exit_code", BAD_INPUT)
        sys.exit(code)


class _PrintableFormatter(logging.Formatter):
    """Formatter that escapes control characters."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the name in logging
        return message(super().formatMessage(record))

    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record))


def _reported() -> tuple[type[Exception], ...]:
    """Return the exception classes for errors that the user can fix. Any other exception is a bug."""
    imported = [getattr(sys.modules[module], name) for module, name in _ERRORS if module in sys.modules]
    return (typer.TyperException, OSError, *imported)


def _words(context: Any) -> list[str]:
    """Return the names of the command groups between ``frobs`` and the command to look up."""
    return [] if context.parent is None else [*_words(context.parent), context.info_name]


def _line(error: Exception) -> str:
    """Return an error message as a single line. A table in the message follows on separate lines."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, typer.TyperException):
        message = error.format_message().strip().replace("\n\t", " ").replace("\n", " ")
        context = getattr(error, "ctx", None)
        hint = f" Run '{context.command_path} --help' for usage." if context else ""
        return f"{message[:1].lower()}{message[1:].rstrip('.')}.{hint}"
    return str(error).strip() or type(error).__name__


def _accept_any_encoding() -> None:
    """Make stdout and stderr print '?' for characters that their encoding does not support, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")


def _write_no_more() -> None:
    """Redirect stdout to the null device, so that buffered output is discarded when the interpreter shuts down."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _is_integer(parameter: Any) -> bool:
    annotation = getattr(parameter, "type_descriptor", None) and parameter.type_descriptor.annotation
    return annotation is int or int in get_args(annotation)


def _as_integer(arg: str, names: Collection[str], is_value: bool) -> str:
    """Rewrite the value of an integer option in an argument, which is the value itself or ``name=value``."""
    name, sign, value = ("", "", arg) if is_value else arg.partition("=")
    if not is_value and not (sign and name in names):
        return arg
    try:
        number = Decimal(value)
    except InvalidOperation:
        return arg
    if not number.is_finite() or number.adjusted() >= _MOST_DIGITS or number != number.to_integral_value():
        return arg
    return f"{name}{sign}{int(number)}"


def _without_types(parameters: list[Any]) -> list[Any]:
    """Let flags show no type in the help, because they take no value. Typer would show ``<bool>``."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters
