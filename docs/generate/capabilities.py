"""Generates the page of the capabilities, with the level that each installed simulator declares."""

import importlib.util

from layers import ROOT

from frobs_core import plugins
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import Level, SimulatorRecord
from generate.rst import code, escape, heading, label, table


def page() -> str:
    """Return the page."""
    simulators = plugins.records("simulator")
    rows = [
        (
            code(name),
            escape(capability.summary),
            *(str(simulator.capabilities.get(name, Level.UNSUPPORTED)) for simulator in simulators.values()),
        )
        for name, capability in known_capabilities().items()
    ]
    text = label("capabilities") + heading("Capabilities")
    text += (
        "Each simulator declares a level for each capability: ``exact``, ``approximate`` or ``unsupported``. Tasks and "
        "controllers declare the capabilities that they require. If the simulator of an environment does not meet these "
        "requirements, an error with a table of the missing capabilities is raised before anything is built.\n\n"
    )
    text += table(["capability", "meaning", *(escape(name) for name in simulators)], rows)
    needs = [
        (escape(f"{kind} ") + code(name), ", ".join(f"{code(what)} {level}" for what, level in record.needs.items()))
        for kind in ("controller", "task")
        for name, record in plugins.records(kind).items()
    ]
    return text + heading("Required capabilities", "-") + table(["", "requires at least"], needs)


def unsupported() -> str:
    """Return a Markdown table of unsupported capabilities by simulator, including the paced simulator template."""
    simulators = [*plugins.records("simulator").values(), _paced()]
    lines = ["| simulator | unsupported capabilities |", "|---|---|"]
    for record in simulators:
        levels = getattr(record, "capabilities", {})
        missing = [name for name in known_capabilities() if not levels.get(name, Level.UNSUPPORTED)]
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
