"""The page of the errors."""

from frobs_core import errors
from generate.rst import directive, heading, label, literal


def classes() -> list[type[Exception]]:
    """Return every error of FRobs, in the order of the file."""
    return [
        value
        for value in vars(errors).values()
        if isinstance(value, type) and issubclass(value, errors.FrobsError) and value.__module__ == errors.__name__
    ]


def page() -> str:
    """Return the page."""
    tree = [line for line in errors.__doc__.splitlines() if line.startswith("    ")]
    text = label("errors") + heading("Errors")
    text += (
        "Every error that FRobs raises on purpose is a :exc:`~frobs_core.errors.FrobsError`. Its message says what was "
        "asked, what exists and what to do; the objects that it is about are its attributes. On the command line it is "
        "one line and exit code 2.\n\n"
    )
    text += literal("\n".join(line[4:] for line in tree)) + directive("module", "frobs_core.errors")
    return text + "".join(
        directive("autoexception", f"frobs_core.errors.{error.__name__}", no_members="") for error in classes()
    )
