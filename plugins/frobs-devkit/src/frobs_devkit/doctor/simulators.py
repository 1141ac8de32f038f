"""Checks how each installed simulator represents a robot.

The checks cover whether the simulator can build the robot, which links overlap in the home position, and how the
simulator translates each kind of element in the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing

from frobs_core import plugins
from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Overlap, Placement, Robot, Scene
from frobs_core.models import RobotModel
from frobs_core.util.errors import FrobsError
from frobs_core.util.install_hints import local_install_hint
from frobs_devkit.doctor.robot_report import Finding, Severity, SimulatorFacts, TranslatedElement, warning
from frobs_devkit.simulations import TIMESTEP
from frobs_models import elements

_DEEP = 1e-4  # [m] smaller overlaps between links are not reported


def simulator_facts(
    model: RobotModel, names: Sequence[str] = (), home: Mapping[str, float] | None = None
) -> tuple[SimulatorFacts, ...]:
    """Return the facts about the named simulators, or about all installed simulators that are not paced."""
    for name in names:
        plugins.get_record("simulator", name)
    installed = plugins.records("simulator").items()
    chosen = names or [name for name, record in installed if not getattr(record, "is_paced", False)]
    return tuple(_facts(name, model, home or {}) for name in chosen)


def _facts(name: str, model: RobotModel, home: Mapping[str, float]) -> SimulatorFacts:
    report = plugins.get_report("simulator", name)
    builds: bool | None = None
    overlaps: Sequence[Overlap] | None = None
    rows: tuple[TranslatedElement, ...] = ()
    reason = ""
    try:
        cls: type[Simulation] = plugins.get_record("simulator", name).load()
        rows = _elements(cls, model)
        builds, reason, overlaps = _build(cls, model, home)
    except FrobsError as error:  # the simulator is installed, but a package that it requires is not
        reason = str(error)
    return SimulatorFacts(
        name=name,
        distribution=report.distribution,
        version=report.version,
        builds=builds,
        reason=reason,
        overlaps=None if overlaps is None else tuple(vars(o) for o in overlaps if o.depth > _DEEP),
        elements=rows,
    )


def _build(
    cls: type[Simulation], model: RobotModel, home: Mapping[str, float]
) -> tuple[bool, str, Sequence[Overlap] | None]:
    """Build only the robot at home, and return whether this succeeded, the reason if not, and the overlaps."""
    placement = Placement(
        robot=Robot(model=str(model.path), name=model.name, home=home), model=model, command_mode=CommandMode.POSITION
    )
    scene = Scene(floor=False, gravity=(0.0, 0.0, 0.0), cameras={})
    try:
        simulation = cls({"robot": placement}, scene, num_envs=1, physics_timestep=TIMESTEP)
    except FrobsError as error:
        return False, getattr(error, "reason", str(error)), None  # omits the path, which the report already contains
    except Exception as error:  # the file may trigger unexpected errors in the engine
        return False, f"{type(error).__name__}: {' '.join(str(error).split())}", None
    with closing(simulation):
        return True, "", simulation.overlaps("robot")


def _elements(cls: type[Simulation], model: RobotModel) -> tuple[TranslatedElement, ...]:
    translations = cls.translation(model)
    rows = []
    for kind, names in elements(model).items():
        known = [row for row in translations if row.element == kind]
        rows += [TranslatedElement(kind, r.names or names, r.treatment.value, r.how, r.changes_motion) for r in known]
        if not known:
            rows.append(TranslatedElement(kind, names, "unknown", ""))
    return tuple(rows)


def simulator_findings(model: RobotModel, facts: Sequence[SimulatorFacts]) -> Iterator[Finding]:
    """Yield findings about simulators that cannot represent the robot, and about overlapping links."""
    if not facts:
        problem = "no simulator is installed, so the robot was not built and not checked for overlaps"
        advice = local_install_hint("pip install frobs-sim-mujoco")
        yield Finding("no-simulator", Severity.NOTE, f"robot '{model.name}'", problem, advice)
    tried = [simulator for simulator in facts if simulator.builds is not None]
    nowhere = not any(simulator.builds for simulator in tried)
    for simulator in facts:
        about = f"simulator '{simulator.name}'"
        if simulator.builds is None:
            problem = f"the simulator was not checked: {simulator.reason}"
            yield Finding("simulator-unavailable", Severity.NOTE, about, problem)
        elif not simulator.builds:
            severity = Severity.ERROR if nowhere else Severity.WARNING
            problem = f"the simulator cannot simulate the robot: {simulator.reason}"
            advice = "fix the reported problem" if nowhere else "fix the reported problem, or use another simulator"
            yield Finding("refused", severity, about, problem, advice)
        else:
            for row in simulator.elements:
                if row.changes_motion:
                    names = ", ".join(row.names[:3]) + (", …" if len(row.names) > 3 else "")
                    yield warning(
                        "motion-differs",
                        about,
                        f"the simulator does not fully support {row.element.replace('_', ' ')} ({names}), which "
                        f"changes the robot's motion: {row.how}",
                        "use a simulator that supports these elements, or remove them from the file",
                    )
    yield from _overlaps(tried)


def _overlaps(facts: Sequence[SimulatorFacts]) -> Iterator[Finding]:
    """Yield one finding for each pair of links that overlap in the home position in any simulator."""
    pairs: dict[tuple[str, str], dict[str, float]] = {}
    for simulator in facts:
        for overlap in simulator.overlaps or ():
            first, second = sorted((overlap["first"], overlap["second"]))
            depths = pairs.setdefault((first, second), {})
            depths[simulator.name] = max(overlap["depth"], depths.get(simulator.name, 0.0))
    for (first, second), depths in pairs.items():
        texts = [f"{1000.0 * depth:.2g} mm in {name}" for name, depth in depths.items()]
        yield warning(
            "overlap-at-home",
            f"link '{first}'",
            f"the link overlaps with link '{second}' in the home position ({', '.join(texts)}); the engine either "
            "ignores contacts between these links or pushes them apart",
            "use smaller collision shapes, or another home position (home={…})",
        )
