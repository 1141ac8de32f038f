"""Parses XML, stores line numbers, and rejects document types, because their entities could expand excessively."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree
from xml.parsers import expat

from frobs_core.util.budgets import Meter
from frobs_core.util.errors import ModelFileError, nearest
from frobs_core.util.files import read_limited
from frobs_models.budgets import BUDGETS

_DEPTH = BUDGETS["robot file"]["levels of nesting"]  # the readers are recursive, and Python limits nested calls
_ATTRIBUTES = BUDGETS["robot file"]["attributes of one element"]
_CHARACTERS = BUDGETS["robot file"]["characters of numbers"]
_DOCTYPE = (
    "declares a document type (<!DOCTYPE …>), which robot models do not need. Remove "
    "the declaration, because its entities could exhaust the memory or read other files."
)


class Element(ElementTree.Element):
    """An XML element.

    Attributes:
        file: File that contains the element.
        line: Line number of the start tag, starting at 1, or None if macros generated the text.
    """

    file: Path
    line: int | None

    def named(self) -> str:
        """Return the name of this element for messages, such as ``<joint name="elbow">``."""
        name = self.get("name")
        return f'<{self.tag} name="{name}">' if name else f"<{self.tag}>"

    def refuse(self, reason: str) -> NoReturn:
        """Raise a ModelFileError that contains the ``reason``, this element, its file and its line."""
        raise ModelFileError(self.file, f"{self.named()}: {reason}", self.line)

    def children(self, *tags: str) -> Iterator[Element]:
        """Yield the children with one of these tags, or all children if no tag is given."""
        for child in self:
            if isinstance(child, Element) and (not tags or child.tag in tags):
                yield child

    def descendants(self, tag: str) -> Iterator[Element]:
        """Yield the elements with this tag at any depth, including this element, in file order."""
        for element in self.iter(tag):
            assert isinstance(element, Element)  # the parser creates only elements of this type
            yield element

    def child(self, tag: str) -> Element | None:
        """Return the first child with this tag."""
        return next(self.children(tag), None)

    def required(self, attribute: str) -> str:
        """Return a required attribute, which must not be empty."""
        value = (self.get(attribute) or "").strip()
        return value or self.refuse(f"the attribute '{attribute}' is missing or empty.")

    def numbers(
        self, attribute: str, count: int | None = None, default: str | None = None, limit: float = math.inf
    ) -> tuple[float, ...]:
        """Return the numbers in an attribute, which must be finite and between -``limit`` and ``limit``.

        The attribute must contain ``count`` numbers, or at least one number if ``count`` is None. If ``default`` is
        None, the attribute is required.
        """
        text = self.get(attribute, default)
        if text is None:
            self.refuse(f"the attribute '{attribute}' is missing; it must contain {_numbers(count)}.")
        if len(text) > _CHARACTERS:
            self.refuse(f"the attribute '{attribute}' has {len(text):,} characters; the limit is {_CHARACTERS:,}.")
        try:
            values = parse_numbers(text)
        except ValueError:
            hint = (
                " Macros are expanded only in files whose names end in '.xacro'." if re.search(r"\$[({]", text) else ""
            )
            self.refuse(f'{attribute}="{text}" is not {_numbers(count)}.{hint}')
        if len(values) != (count or max(1, len(values))):
            self.refuse(f'{attribute}="{text}" contains {_numbers(len(values))}; it requires {count or 1}.')
        if not all(math.isfinite(value) for value in values):
            self.refuse(f'{attribute}="{text}" is not finite.')
        if max(map(abs, values)) > limit:
            self.refuse(f'{attribute}="{text}" exceeds the limit of {limit:g}.')
        return values

    def number(self, attribute: str, default: str | None = None, limit: float = math.inf) -> float:
        """Return the number in an attribute, which must be finite and between -``limit`` and ``limit``.

        If ``default`` is None, the attribute is required.
        """
        return self.numbers(attribute, 1, default, limit)[0]

    def cap(self, attribute: str) -> float:
        """Return the number in an attribute, which must be finite or ``inf``. A missing attribute is 0."""
        return math.inf if self.get(attribute) == "inf" else self.number(attribute, "0")


def parse_numbers(text: str) -> tuple[float, ...]:
    """Return the numbers in a text that are separated by whitespace, as defined by ``xs:double``.

    Raises:
        ValueError: The text contains something else. In contrast to Python, XML does not allow underscores, digits
            other than 0 to 9, and whitespace such as no-break spaces.
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"not a number: {text}")
    return tuple(map(float, text.split()))


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return a sentence that suggests the most similar name, with a leading space, or ``""`` if no name is similar."""
    close = nearest(name, known)
    return f" Did you mean '{close}'?" if close else ""


def _numbers(count: int | None) -> str:
    if count is None:
        return "numbers"
    return "one number" if count == 1 else f"{count} numbers"


def parse_xml(text: bytes | str, file: Path, *, expanded: bool = False, meter: Meter | None = None) -> Element:
    """Parse XML. A document type is rejected before its content is read.

    Args:
        text: The XML.
        file: The file, for messages.
        expanded: Whether macros generated the text, in which case its line numbers differ from the line numbers in the
            file.
        meter: Counter for the elements of this file and the files that include it.

    Raises:
        ModelFileError: The text is empty or broken, has a document type, or exceeds a limit.
    """
    if not text.strip():
        raise ModelFileError(file, "the file is empty.")
    trimmed = text.lstrip()  # many files begin with an empty line, which XML forbids before the XML declaration
    skipped = text[: len(text) - len(trimmed)]
    first_line = skipped.count(b"\n" if isinstance(skipped, bytes) else "\n")  # type: ignore[arg-type]
    meter = meter or file_meter(file)
    stack: list[Element] = []
    roots: list[Element] = []
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.buffer_size = len(text)  # otherwise, a long text is copied once per 8 KiB

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes)
        element.file, element.line = file, None if expanded else first_line + parser.CurrentLineNumber
        meter.spend("elements")
        meter.spend("attributes", len(attributes))
        if len(stack) >= _DEPTH:
            element.refuse(f"elements are nested deeper than {_DEPTH} levels.")
        if len(attributes) > _ATTRIBUTES:
            element.refuse(f"the element has {len(attributes):,} attributes; the limit is {_ATTRIBUTES}.")
        (stack[-1].append if stack else roots.append)(element)
        stack.append(element)

    def data(text: str) -> None:
        if len(stack[-1]):
            stack[-1][-1].tail = (stack[-1][-1].tail or "") + text
        else:
            stack[-1].text = (stack[-1].text or "") + text

    def doctype(*_: Any) -> None:
        raise ModelFileError(file, f"the file {_DOCTYPE}", first_line + parser.CurrentLineNumber)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.CharacterDataHandler = data
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(trimmed, True)
    except expat.ExpatError as error:
        reason = f"not well-formed XML: {expat.ErrorString(error.code)} (column {error.offset + 1})."
        raise ModelFileError(file, reason, first_line + error.lineno) from error
    except (LookupError, ValueError) as error:  # an encoding that Python does not support, or a NUL character
        raise ModelFileError(file, f"not readable as XML: {error}.") from error
    return roots[0]


def file_meter(file: Path) -> Meter:
    """Return a counter for the contents of a model file and of the files that it includes."""

    def refuse(reason: str) -> NoReturn:
        raise ModelFileError(file, reason)

    return Meter(BUDGETS["robot file"], refuse)


def to_text(root: Element) -> str:
    """Return the XML text of a tree."""
    return ElementTree.tostring(root, encoding="unicode")


def read_bytes(file: Path) -> bytes:
    """Read a model file.

    Raises:
        ModelFileError: The file cannot be read, is not a regular file, or exceeds the size limit.
    """
    try:
        return read_limited(file, BUDGETS["robot file"]["bytes"])
    except OSError as error:
        raise ModelFileError(file, f"cannot be read: {error.strerror or error}.") from error
