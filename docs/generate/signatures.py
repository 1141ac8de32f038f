"""Signatures as they stand in the source: ``Floats | None``, not what the alias unfolds to."""

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx.util.inspect import object_description
from sphinx.util.nodes import make_refnode


class _Source(str):
    """Text that a signature shows without quotation marks."""

    __slots__ = ()
    __repr__ = str.__str__


def as_written(app: Any, what: str, name: str, thing: Any, options: Any, signature: str | None, returns: str | None):
    """Return a signature with the annotations of the source; None where it has none."""
    if what not in ("class", "exception", "function", "method") or not signature:
        return None
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return None
    names = vars(import_module(thing.__module__))
    source = vars(thing).get("__annotations__", {}) if hasattr(thing, "model_fields") else {}  # pydantic unfolds them
    written = [
        parameter.replace(annotation=source.get(parameter.name, parameter.annotation))
        for parameter in found.parameters.values()
    ]
    parameters = [_written(parameter, names) for parameter in written]
    if what == "method" and parameters and parameters[0].name in ("self", "cls"):
        del parameters[0]
    shown = str(found.replace(parameters=parameters, return_annotation=inspect.Signature.empty))
    returned = found.return_annotation
    return shown, _qualified(returned, names) if isinstance(returned, str) else returns


def plain_first_line(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Keep napoleon from taking what stands before a colon in an attribute's first line for its type."""
    if what in ("attribute", "data", "property"):
        lines[:0] = ["..", ""]  # an empty comment


def resolve(app: Any, env: Any, node: Any, contnode: Any) -> Any:
    """Link a name in a signature to what bears it here, and a role in a docstring to what a parent class explains.

    What a signature names and nothing here bears stays text; a role must resolve, or the build fails.
    """
    if node.get("refdomain") != "py":
        return None
    domain = env.domains.python_domain
    for name, mode in _candidates(node, isinstance(contnode, nodes.literal)):
        found = domain.find_obj(env, None, None, name, None, searchmode=mode)
        if len(found) == 1:
            full_name, entry = found[0]
            return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, contnode, full_name)
    return None if isinstance(contnode, nodes.literal) else contnode


def _candidates(node: Any, is_role: bool) -> Iterator[tuple[str, int]]:
    """Yield the names to look for, each with Sphinx's search mode: 0 exact, 1 by the end of the name."""
    target = node["reftarget"]
    if not is_role:
        yield target.rpartition(".")[2], 1
    elif node.get("py:class") and "." not in target:
        module = import_module(node["py:module"]) if node.get("py:module") else None
        for parent in getattr(getattr(module, node["py:class"], None), "__mro__", ()):
            for package in (
                parent.__module__,
                parent.__module__.rpartition(".")[0],
            ):  # packages export their modules' names
                yield f"{package}.{parent.__qualname__}.{target}", 0


def _qualified(annotation: str, names: dict[str, Any]) -> str:
    """Return an annotation with the full names of the project's classes, because two of them may have the same name.

    Sphinx shows what follows the last dot of a name that begins with a tilde.
    """

    def full(match: re.Match[str]) -> str:
        cls = names.get(match[0])
        own = inspect.isclass(cls) and cls.__module__.startswith("frobs_")
        return f"~{cls.__module__}.{cls.__qualname__}" if own else match[0]

    return re.sub(r"(?<![\w.])[A-Z]\w*", full, annotation)


def _written(parameter: inspect.Parameter, names: dict[str, Any]) -> inspect.Parameter:
    empty = inspect.Parameter.empty
    annotation, default = parameter.annotation, parameter.default
    if isinstance(annotation, str):
        annotation = _Source(_qualified(annotation, names))
    if default is not empty:
        default = _Source("…" if inspect.isfunction(default) else object_description(default))
    return parameter.replace(annotation=annotation, default=default)
