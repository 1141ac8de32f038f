"""Improves xacro's error messages by adding line numbers and the available names."""

from __future__ import annotations

import re
from pathlib import Path

from frobs_core.util.errors import ModelFileError
from frobs_models.xmltree import Element, suggestion

_LONGEST = 2_000  # maximum length of xacro's message, which can quote large parts of the file


class Declarations:
    """Names that the xacro files declare or use, and the contents of these files.

    Error messages use the names for suggestions and the contents for line numbers.
    """

    def __init__(self) -> None:
        self.arguments: set[str] = set()
        self.names: set[str] = set()  # properties and macro parameters
        self.macros: dict[str, list[str]] = {}  # parameters of each macro
        self.texts: dict[Path, str] = {}

    def note(self, file: Path, root: Element, text: bytes) -> None:
        """Store the declarations of a file."""
        self.texts[file] = text.decode(errors="replace")
        for element in root.iter():
            name = element.get("name", "")
            if element.tag == "xacro:arg":
                self.arguments.add(name)
            elif element.tag == "xacro:property":
                self.names.add(name)
            elif element.tag == "xacro:macro":
                parameters = [re.split(r":?=", word)[0] for word in element.get("params", "").split()]
                self.macros[name] = parameters
                self.names.update(parameters)

    def line(self, file: Path, pattern: str) -> int | None:
        """Return the number of the first line that matches ``pattern``. xacro itself does not report line numbers."""
        match = re.search(pattern, self.texts.get(file, ""))
        return self.texts[file].count("\n", 0, match.start()) + 1 if match else None


def choices(name: str, available: set[str]) -> str:
    """Return a text that suggests the most similar name and lists all available names."""
    return f"{suggestion(name, available)} Available: {', '.join(sorted(available)) or 'none'}."


def explain(error: Exception, file: Path, seen: Declarations) -> ModelFileError:
    """Convert an exception from xacro to an error whose message explains how to fix the file."""
    cause = getattr(error, "exc", None) or error
    text = str(error)[:_LONGEST].replace("\n", " ").strip() or type(error).__name__
    if isinstance(cause, RecursionError):
        return ModelFileError(file, "infinite recursion: macros or properties refer to each other or to themselves.")
    if match := re.search(r"Undefined substitution argument '?([^' ]+)'?", text):
        name = match[1]
        reason = (
            f"the xacro argument '{name}' has no value; set it with xacro_args={{'{name}': VALUE}} in an environment, "
            f"xacro_args={{'{name}': VALUE}} in a Robot description, or --args {name}:=VALUE in a command."
        )
        return ModelFileError(file, reason, seen.line(file, rf"\$\(arg\s+{re.escape(name)}\s*\)"))
    if match := re.search(r"name '(\w+)' is not defined", text):
        name = match[1]
        reason = f"the property '{name}' is not defined.{choices(name, seen.names)}"
        return ModelFileError(file, reason, seen.line(file, rf"\$\{{[^}}$]*\b{re.escape(name)}\b"))
    if match := re.search(r"unknown macro name: xacro:(\S+)", text):
        name = match[1]
        reason = f"the macro '{name}' is not defined.{choices(name, set(seen.macros))}"
        return ModelFileError(file, reason, seen.line(file, rf"<xacro:{re.escape(name)}\b"))
    if match := re.search(r'Invalid parameter "([^"]+)"', text):
        macro, call = _macro_of(error)
        name = match[1]
        reason = f"the macro '{macro}' has no parameter '{name}'.{choices(name, set(seen.macros.get(macro, [])))}"
        return ModelFileError(file, reason, seen.line(file, rf"{call}[^<>]*\b{re.escape(name)}\s*="))
    if match := re.search(r"Undefined parameters \[([^\]]*)\]", text):
        macro, call = _macro_of(error)
        reason = f"a call to the macro '{macro}' does not set the required parameters {match[1]}."
        return ModelFileError(file, reason, seen.line(file, call))
    return ModelFileError(file, f"xacro: {text}.")


def _macro_of(error: Exception) -> tuple[str, str]:
    """Return the name of the macro that caused an error, and a regular expression that matches calls of the macro."""
    macros = getattr(error, "macros", [])
    name = macros[0].body.getAttribute("name").removeprefix("xacro:") if macros else "?"
    return name, rf"<xacro:{re.escape(name)}\b"
