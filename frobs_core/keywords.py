"""Keywords that a constructor accepts, including those that it passes on to its parents."""

from __future__ import annotations

import inspect


def constructor_parameters(cls: type) -> dict[str, inspect.Parameter]:
    """Return the parameters of a constructor by name, in their order.

    If a constructor takes ``**keywords``, the parameters of the next constructor in the method resolution order follow.
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
