"""The page of the capabilities, and of how well each installed simulator has them."""

from frobs_core import plugins
from frobs_core.capabilities import Level, abilities
from generate.rst import code, escape, heading, label, table


def page() -> str:
    """Return the page."""
    simulators = plugins.records("simulator")
    rows = [
        (
            code(name),
            escape(ability.summary),
            *(str(simulator.capabilities.get(name, Level.UNSUPPORTED)) for simulator in simulators.values()),
        )
        for name, ability in abilities().items()
    ]
    text = label("capabilities") + heading("Capabilities")
    text += (
        "What a simulator can do, each at a level: ``exact``, ``approximate`` or ``unsupported``. Tasks and controllers "
        "state what they need; an environment that asks for more than its simulator has is refused, with a table of "
        "what is missing, before anything is built.\n\n"
    )
    text += table(["capability", "meaning", *(escape(name) for name in simulators)], rows)
    needs = [
        (escape(f"{kind} ") + code(name), ", ".join(f"{code(what)} {level}" for what, level in record.needs.items()))
        for kind in ("controller", "task")
        for name, record in plugins.records(kind).items()
    ]
    return text + heading("Who needs what", "-") + table(["", "needs at least"], needs)
