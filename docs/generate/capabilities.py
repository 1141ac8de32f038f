"""The page of the capabilities, and of how well each installed simulator has them."""

import importlib.util

from layers import ROOT

from frobs_core import plugins
from frobs_core.capabilities import Level, abilities
from frobs_core.specs import SimulatorRecord
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


def unsupported() -> str:
    """Return a Markdown table of what each simulator does not support, with the paced one of the templates."""
    simulators = [*plugins.records("simulator").values(), _paced()]
    lines = ["| simulator | unsupported abilities |", "|---|---|"]
    for record in simulators:
        levels = getattr(record, "capabilities", {})
        missing = [name for name in abilities() if not levels.get(name, Level.UNSUPPORTED)]
        lines.append(f"| `{record.name}` | {', '.join(missing)} |")
    return "\n".join([*lines, ""])


def _paced() -> SimulatorRecord:
    spec = importlib.util.spec_from_file_location("my_paced_simulator", ROOT / "templates" / "my_paced_simulator.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    record: SimulatorRecord = module.RECORD
    return record
