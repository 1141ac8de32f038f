"""Signatures as they stand in the source: ``Floats | None``, not what the alias unfolds to."""

import inspect
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
    parameters = [_written(parameter) for parameter in found.parameters.values()]
    if what == "method" and parameters and parameters[0].name in ("self", "cls"):
        del parameters[0]
    shown = str(found.replace(parameters=parameters, return_annotation=inspect.Signature.empty))
    return shown, found.return_annotation if isinstance(found.return_annotation, str) else returns


def resolve_annotation(app: Any, env: Any, node: Any, contnode: Any) -> Any:
    """Link a name in a signature to what bears it here; one that nothing bears stays text.

    A role that an author wrote is left alone: it must resolve, or the build fails.
    """
    if isinstance(contnode, nodes.literal) or node.get("refdomain") != "py":
        return None
    domain = env.domains.python_domain
    found = domain.find_obj(env, None, None, node["reftarget"].rpartition(".")[2], None, searchmode=1)
    if len(found) != 1:
        return contnode
    full_name, entry = found[0]
    return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, contnode, full_name)


def _written(parameter: inspect.Parameter) -> inspect.Parameter:
    empty = inspect.Parameter.empty
    annotation, default = parameter.annotation, parameter.default
    if isinstance(annotation, str):
        annotation = _Source(annotation)
    if default is not empty:
        default = _Source(object_description(default))
    return parameter.replace(annotation=annotation, default=default)
