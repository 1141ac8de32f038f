"""Safe reading of YAML files: no code in a file is executed, and errors contain the file and line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from frobs_core.util.budgets import BUDGETS, Meter
from frobs_core.util.errors import ConfigFileError
from frobs_core.util.files import read_limited
from frobs_core.util.plain import plain

_LIMITS = BUDGETS["YAML file"]

_STANDARD = "tag:yaml.org,2002:"
_NUMBER_TAGS = {_STANDARD + name for name in ("int", "float")}
_PLAIN_TAGS = _NUMBER_TAGS | {_STANDARD + name for name in ("null", "bool", "str")}
_SHOWN = 40  # maximum number of characters of a value in an error message


class ConfigMapping(dict[str, Any]):
    """Mapping that stores the file and line of each key.

    Args:
        values: The mapping.
        origins: File and line number, starting at 1, of each key that was read from a file.
    """

    def __init__(
        self, values: Mapping[str, Any] | None = None, origins: Mapping[str, tuple[Path, int]] | None = None
    ) -> None:
        super().__init__(values or {})
        self.origins = dict(origins or {})


class LimitedLoader(yaml.SafeLoader):
    """PyYAML's safe loader with limits on the nesting depth, the number of values and the length of numbers.

    Args:
        stream: The YAML text.
    """

    _depth = 0

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._meter = Meter(_LIMITS, self._refuse)

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        """Return the next node.

        Raises:
            yaml.MarkedYAMLError: A limit is exceeded.
        """
        self._depth += 1
        self._meter.check("levels of nesting", self._depth)
        self._meter.spend("values")
        node: Node | None = super().compose_node(parent, index)
        if isinstance(node, ScalarNode) and node.tag in _NUMBER_TAGS:
            self._meter.check("digits in a number", len(node.value))  # Python needs quadratic time to read a number
        self._depth -= 1
        return node

    def _refuse(self, reason: str) -> NoReturn:
        mark = self.peek_event().start_mark if self.check_event() else None  # type: ignore[no-untyped-call]
        raise yaml.MarkedYAMLError(problem=reason.rstrip("."), problem_mark=mark)


class _Loader(LimitedLoader):
    """YAML loader that reads 1e-4 as a number, and a date or 12:30 as a string."""


_NUMBERS = {
    "int": r"[-+]?(0b[01_]+|0[0-7_]+|0|[1-9][\d_]*|0x[\da-fA-F_]+)",
    "float": r"[-+]?(\d[\d_]*\.[\d_]*|\.\d[\d_]*|(\d[\d_]*(\.[\d_]*)?|\.\d[\d_]*)[eE][-+]?\d+|\.(inf|Inf|INF))"
    r"|\.(nan|NaN|NAN)",
}
"""Numbers of YAML 1.1 that YAML 1.2 kept. The patterns match in linear time."""

_Loader.yaml_implicit_resolvers = {
    first: [(tag, regexp) for tag, regexp in resolvers if tag not in {*_NUMBER_TAGS, _STANDARD + "timestamp"}]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _kind, _pattern in _NUMBERS.items():
    _Loader.add_implicit_resolver(_STANDARD + _kind, re.compile(f"^({_pattern})$", re.ASCII), list("-+.0123456789"))


def load_yaml(path: Path | str) -> ConfigMapping:
    """Read a YAML file whose top level is a mapping.

    Args:
        path: The file, UTF-8.

    Returns:
        The mapping. Every nested mapping is also a :class:`ConfigMapping`, which stores the line of each key.

    Raises:
        ConfigFileError: The file is missing, empty or too large, is not UTF-8 or not valid YAML, is not a mapping, uses
            tabs for indentation, repeats a key, or contains a tag that would build a Python object.
    """
    path = Path(path)
    try:
        data = read_limited(path, _LIMITS["bytes"])
    except OSError as error:
        raise ConfigFileError(path, None, f"cannot be read: {error.strerror}; check the path.") from error
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ConfigFileError(path, line, "is not UTF-8 text; save it with UTF-8 encoding.") from error
    return load_yaml_text(text, path)


def load_yaml_text(text: str, path: Path | str = "<text>") -> ConfigMapping:
    """Read YAML text whose top level is a mapping. For the errors, see :func:`load_yaml`.

    Args:
        text: The YAML text.
        path: Name of the text in error messages.
    """
    path = Path(path)
    node = _compose(text, path)
    if node is None:
        raise ConfigFileError(path, None, "is empty; write 'key: value' lines.")
    if not isinstance(node, MappingNode):
        raise ConfigFileError(path, _line(node), "does not have a mapping at its top level; write 'key: value' lines.")
    result = _Builder(path).build(node)
    assert isinstance(result, ConfigMapping)
    return result


def load_yaml_value(text: str, name: str) -> Any:
    """Read one YAML value, as in ``--set key=value``.

    Args:
        text: The YAML text. Empty text is read as null.
        name: Name of the value in error messages.

    Raises:
        ConfigFileError: The text is invalid; see :func:`load_yaml`.
    """
    node = _compose(text, Path(name))
    return None if node is None else _Builder(Path(name)).build(node)


def _compose(text: str, path: Path) -> Node | None:
    """Parse text into YAML nodes without constructing values."""
    for number, written in enumerate(text.splitlines(), 1):
        if "\t" in written[: len(written) - len(written.lstrip())] and written.strip():
            raise ConfigFileError(path, number, "this line is indented with a tab; YAML requires spaces.")
    try:
        loader = _Loader(text)
        try:
            node: Node | None = loader.get_single_node()
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        reason = ", ".join(part for part in (error.context, error.problem) if part)
        raise ConfigFileError(path, mark.line + 1 if mark else None, f"is not valid YAML: {reason}.") from error
    except yaml.reader.ReaderError as error:
        line = text[: error.position].count("\n") + 1
        raise ConfigFileError(
            path, line, "contains a control character that YAML does not allow; remove it."
        ) from error
    return node


class _Builder:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._meter = Meter(_LIMITS, self._refuse)
        self._scalars = _Loader("")
        self._open: set[int] = set()

    def build(self, node: Node) -> Any:
        # Each use of an alias builds new values, so limiting their number protects against alias bombs.
        self._place = node
        self._meter.spend("values with aliases expanded")
        if id(node) in self._open:
            raise self._error(node, "an alias refers to itself; write the value explicitly")
        self._open.add(id(node))
        try:
            if isinstance(node, MappingNode) and node.tag == _STANDARD + "map":
                return self._mapping(node)
            if isinstance(node, SequenceNode) and node.tag == _STANDARD + "seq":
                return [self.build(item) for item in node.value]
            if isinstance(node, ScalarNode) and node.tag in _PLAIN_TAGS:
                return self._scalar(node)
        finally:
            self._open.discard(id(node))
        tag = node.tag.replace(_STANDARD, "!!")
        if tag.startswith("!!python"):
            raise self._error(
                node, f"the tag '{tag}' would execute Python code, which is not allowed; write a plain value"
            )
        raise self._error(node, f"the tag '{tag}' is not supported; write a plain value, list or mapping")

    def _scalar(self, node: ScalarNode) -> Any:
        try:
            return self._scalars.construct_object(node)
        except (ValueError, KeyError, IndexError, yaml.YAMLError):
            kind = node.tag.removeprefix(_STANDARD)
            raise self._error(
                node, f"'{node.value:.{_SHOWN}}' is not a valid {kind}; correct the value, or put it in quotes"
            ) from None

    def _mapping(self, node: MappingNode) -> ConfigMapping:
        result = ConfigMapping()
        for key_node, value_node in node.value:
            key = key_node.value
            if key_node.tag != _STANDARD + "str":
                raise self._error(key_node, f"the key {_shown(key)} is not a string; put quotes around it")
            if key in result:
                first = result.origins[key][1]
                raise self._error(
                    key_node, f"the key '{key}' is already set on line {first}; remove one of the two entries"
                )
            result[key] = self.build(value_node)
            result.origins[key] = (self._path, _line(key_node))
        return result

    def _refuse(self, reason: str) -> NoReturn:
        raise ConfigFileError(self._path, _line(self._place), reason)

    def _error(self, node: Node, reason: str) -> ConfigFileError:
        return ConfigFileError(self._path, _line(node), f"{reason}.")


def _shown(key: Any) -> str:
    return f"'{key}'" if isinstance(key, str) else "in this line"


def _line(node: Node) -> int:
    return int(node.start_mark.line) + 1


def merge(*layers: Mapping[str, Any]) -> ConfigMapping:
    """Merge mappings recursively. Later ``layers`` take precedence. Each key keeps the file and line of its value."""
    result = ConfigMapping()
    for layer in layers:
        origins = layer.origins if isinstance(layer, ConfigMapping) else {}
        for key, value in layer.items():
            if isinstance(value, Mapping):
                below = result.get(key)
                result[key] = merge(below, value) if isinstance(below, Mapping) else merge(value)
            else:
                result[key] = value
            result.origins.pop(key, None)
            if key in origins:
                result.origins[key] = origins[key]
    return result


def find_origin(mapping: Mapping[str, Any], keys: Iterable[str | int]) -> tuple[Path, int] | None:
    """Return the file and line of the innermost key along ``keys``, or None if this key was not read from a file.

    Args:
        mapping: The mapping.
        keys: Key in the mapping, key or index in its value, and so on.
    """
    found = None
    value: Any = mapping
    for key in keys:
        if isinstance(value, ConfigMapping) and key in value.origins:
            found = value.origins[str(key)]
        elif isinstance(value, Mapping):
            found = None  # this key was not read from a file
        try:
            value = value[key]
        except (KeyError, IndexError, TypeError):
            break
    return found


def dump_yaml(mapping: Mapping[str, Any]) -> str:
    """Return the YAML text of ``mapping``, which :func:`load_yaml` can read."""
    text: str = yaml.dump(plain(mapping, for_yaml=True), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)
    return _HIDDEN.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


class _Dumper(yaml.SafeDumper):
    """YAML dumper that quotes strings that :class:`_Loader` would read as numbers."""


_HIDDEN = re.compile("[\xad\u061c\u200b-\u200f\u202a-\u202e\u2060-\u206f\U000e0000-\U000e007f]")
"""Characters that change the order of a text or cannot be seen. PyYAML escapes control characters only."""


def _represent_text(dumper: _Dumper, text: str) -> Node:
    return dumper.represent_scalar(_STANDARD + "str", text, style='"' if _HIDDEN.search(text) else None)


_Dumper.add_representer(str, _represent_text)
_Dumper.yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers
