"""Keywords that a constructor accepts, including keywords that it passes to parent classes."""

from __future__ import annotations

import inspect


def constructor_parameters(cls: type) -> dict[str, inspect.Parameter]:
    """Return a constructor's parameters by name, in the order of their definition.

    If a constructor accepts ``**keywords``, the parameters of the next constructor in the method resolution order are
    appended.
    """
    found: dict[str, inspect.Parameter] = {}
    for parent in cls.__mro__[:-1]:
        if "__init__" not in vars(parent):
            continue
        given = list(inspect.signature(vars(parent)["__init__"]).parameters.values())[1:]
        kinds = {parameter.kind for parameter in given}
        for parameter in given:
            if parameter.kind not in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD):
                found.setdefault(parameter.name, parameter)
        if inspect.Parameter.VAR_KEYWORD not in kinds:
            break
    return found
