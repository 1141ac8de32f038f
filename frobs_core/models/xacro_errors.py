"""What xacro raises, said so that it helps: which name is wrong, what exists, in which line."""

from __future__ import annotations

import re
from pathlib import Path

from frobs_core.errors import ModelFileError
from frobs_core.models.xmltree import Element, suggestion

_LONGEST = 2_000  # of xacro's text: it repeats what the file says, at any length


class Declarations:
    """What the files that were read declare, for messages that suggest a name and find a line."""

    def __init__(self) -> None:
        self.arguments: set[str] = set()
        self.names: set[str] = set()  # properties and macro parameters
        self.macros: dict[str, list[str]] = {}  # the parameters of each
        self.texts: dict[Path, str] = {}

    def note(self, file: Path, root: Element, text: bytes) -> None:
        """Remember what a file declares."""
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
        """Return the first line of a file that matches: xacro's own errors name none."""
        match = re.search(pattern, self.texts.get(file, ""))
        return self.texts[file].count("\n", 0, match.start()) + 1 if match else None


def choices(name: str, available: set[str]) -> str:
    """Suggest the nearest name, and list all."""
    return f"{suggestion(name, available)} It knows: {', '.join(sorted(available)) or 'none'}."


def explain(error: Exception, file: Path, seen: Declarations) -> ModelFileError:
    """Turn what xacro raised into one sentence with a way out."""
    cause = getattr(error, "exc", None) or error
    text = str(error)[:_LONGEST].replace("\n", " ").strip() or type(error).__name__
    if isinstance(cause, RecursionError):
        return ModelFileError(file, "macros or properties that use each other without end.")
    if match := re.search(r"Undefined substitution argument '?([^' ]+)'?", text):
        name = match[1]
        reason = f"the xacro argument '{name}' has no value: give it with xacro_args={{'{name}': VALUE}}."
        return ModelFileError(file, reason, seen.line(file, rf"\$\(arg\s+{re.escape(name)}\s*\)"))
    if match := re.search(r"name '(\w+)' is not defined", text):
        name = match[1]
        reason = f"the property '{name}' is not defined.{choices(name, seen.names)}"
        return ModelFileError(file, reason, seen.line(file, rf"\$\{{[^}}]*\b{re.escape(name)}\b"))
    if match := re.search(r"unknown macro name: xacro:(\S+)", text):
        name = match[1]
        reason = f"the macro '{name}' is not defined.{choices(name, set(seen.macros))}"
        return ModelFileError(file, reason, seen.line(file, rf"<xacro:{re.escape(name)}\b"))
    if match := re.search(r'Invalid parameter "([^"]+)"', text):
        macro, call = _macro_of(error)
        name = match[1]
        reason = f"the macro '{macro}' takes no parameter '{name}'.{choices(name, set(seen.macros.get(macro, [])))}"
        return ModelFileError(file, reason, seen.line(file, rf"{call}[^>]*\b{re.escape(name)}\s*="))
    if match := re.search(r"Undefined parameters \[([^\]]*)\]", text):
        macro, call = _macro_of(error)
        reason = f"the macro '{macro}' needs the parameters {match[1]}, which the call leaves out."
        return ModelFileError(file, reason, seen.line(file, call))
    return ModelFileError(file, f"xacro: {text}.")


def _macro_of(error: Exception) -> tuple[str, str]:
    """Return the name of the macro that an error is about, and a pattern that finds a call of it."""
    macros = getattr(error, "macros", [])
    name = macros[0].body.getAttribute("name").removeprefix("xacro:") if macros else "?"
    return name, rf"<xacro:{re.escape(name)}\b"
