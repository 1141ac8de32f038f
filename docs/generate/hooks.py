"""The page of the hooks and of the records that they return."""

from frobs_core.plugins import hooks
from frobs_core.plugins.records import KINDS, RECORDS
from generate.rst import directive, heading, label, table


def names() -> list[str]:
    """Return the hooks' names, in the order of the file."""
    return [name for name, value in vars(hooks).items() if hasattr(value, "frobs_spec")]


def page() -> str:
    """Return the page."""
    kinds = [
        (
            f":func:`~frobs_core.plugins.hooks.{f'frobs_{kind}s' if kind in KINDS else 'frobs_extensions'}`",
            kind,
            f":class:`~frobs_core.plugins.records.{record.__name__}`",
        )
        for kind, record in RECORDS.items()
    ]
    text = label("hooks") + heading("Hooks and records")
    text += (
        "A plugin is a module that an entry point of the group ``frobs`` names. It may implement any of these hooks. "
        "Each hook takes no arguments and returns frozen records, which state the names of the plugin's parts and the "
        "locations of their implementations.\n\n"
    )
    text += table(["hook", "kind", "returns a list of"], kinds)
    text += heading("Hooks", "-") + directive("module", "frobs_core.plugins.hooks")
    text += "".join(directive("autofunction", f"frobs_core.plugins.hooks.{name}") for name in names())
    text += heading("Records", "-") + directive("module", "frobs_core.plugins.records", no_index="")
    records = ["Record", *(record.__name__ for record in RECORDS.values()), "EnvironmentRecord"]
    return text + "".join(
        directive("autoclass", f"frobs_core.plugins.records.{name}", no_members="") for name in records
    )
