"""Faulty plugins of authors who had read the templates and the interfaces, and not the kit."""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from planting import ROOT, Fault, source_of

from frobs_core import plugins
from frobs_core.plugins.records import AlgorithmRecord, ControllerRecord, Level, SimulatorRecord, TaskRecord
from frobs_devkit.testing import Check, check_algorithm, check_controller, check_robot, check_simulator, check_task

sys.path.append(str(ROOT / "tests" / "contracts"))  # for the arm with a gripper
sys.path.append(str(ROOT / "tests" / "conformance"))  # for the settings of short trainings

PACKAGES = ("by_outsider", "by_strangers")
"""Folders of faults: of one author before version 0.2, and of three authors before version 0.3."""

KINDS = ("task", "controller", "robot", "simulator", "algorithm")

FIRST_TRY = frozenset(
    [
        "last_action_survives_reset",
        "phase_not_in_snapshot",
        "stale_after_reset",
        "action_change_per_second",
        "integral_survives_reset",
        "reset_of_all",
        "snapshot_is_a_view",
        "steps_from_measured",
        "velocity_limit_forgotten",
        "limits_in_degrees",
        "contacts_one_step_late",
        "efforts_before_clipping",
        "first_row_is_held",
        "paced_reads_before_it_waits",
        "picture_upside_down",
        "pose_written_to_first_rows",
        "turning_in_own_frame",
        "wrench_of_the_child",
        "deviation_lost",
        "environment_seeded_again",
        "learns_from_the_worst",
        "same_seed_for_all",
        "trains_so_many_more",
    ]
)
"""Faults of the first author that the kit caught when they were written; it was improved for the others."""

FIRST_TRY_OF_STRANGERS = frozenset(
    [
        "compound_inertia",
        "cross_entropy_checkpoint_before_learning",
        "dqn_values_beyond_terminal_states",
        "efforts_before_the_gears",
        "goes_on_when_told_to_stop",
        "gripping_casters",
        "half_separation",
        "joint_position_change_in_radians",
        "last_joint_without_gains",
        "late_clip",
        "memory_survives_episodes",
        "mujoco_link_velocity_at_the_mass_center",
        "mujoco_mass_without_inertia",
        "mujoco_wrench_at_the_origin",
        "ppo_time_limit_is_terminal",
        "redraw_all",
        "relabels_with_sparse_reward",
        "resultant_on_second_side",
        "starts_from_home",
        "tcp_impedance_mass_center_unrotated",
        "td3_loads_no_target_networks",
        "template_body_keeps_its_velocity",
        "time_includes_homing",
        "time_limit_terminates",
        "velocity_from_last_reading",
        "weight_at_link_frames",
        "wraps_angles",
        "wrench_in_body_frame",
    ]
)
"""Faults of the three authors that the kit caught when they were written."""

NOTES: Mapping[str, str] = {
    "action_change_per_second": (
        "this plugin was at first caught only because its commands also jump farther than the velocity limits allow; "
        "nothing checked `max_action_change`"
    ),
    "last_action_survives_reset": (
        "the penalty also changes the sparse reward, which the first check finds; `reading_changes_nothing` and "
        "`same_seed_repeats` find the mistake itself"
    ),
    "environment_seeded_again": (
        "this plugin was at first caught only by `continues_exactly`, because a training run that is loaded again resets "
        "without the seed"
    ),
}
"""Faults that were caught for another reason than the mistake that their author had in mind."""

SOUND: Mapping[str, str] = {
    "task.reach": "from templates.my_reach import MyReach as Faulty",
    "task.drive": "from templates.my_drive import MyDrive as Faulty",
    "controller.sound": "from templates.my_controller import MyController as Faulty",
    "robot.arm": "from templates.my_arm import MY_ARM as FAULTY",
    "robot.rover": "from templates.my_rover import MY_ROVER as FAULTY",
    "robot.gripper": "from arm_and_gripper import ARM, FINGERS\nFAULTY = ARM.attach('flange', FINGERS)",
    "simulator.joints": (
        "from templates.my_simulator import MySimulator as Faulty\n"
        "EXACT, APPROXIMATE = 'determinism snapshot teleport pause batched', 'drive'"
    ),
    "simulator.paced": (
        "from templates.my_paced_simulator import MyPacedSimulator as Faulty\n"
        "EXACT, APPROXIMATE = '', 'real_time drive'"
    ),
    "algorithm.sound": "from templates.algorithm import CrossEntropy as Faulty",
}
"""Plugins without a fault, in which nothing may be caught: name of a module, and its source."""


def faults(package: str) -> Iterator[Fault]:
    """Yield the faults of a folder; the name of each is the first sentence of its module."""
    folder = Path(__file__).with_name(package)
    for kind in KINDS:
        for path in sorted((folder / kind).glob("*.py")):
            if path.stem != "edited":
                module = f"{package}.{kind}.{path.stem}"
                name = (ast.get_docstring(ast.parse(source_of(module))) or "").rstrip(".")
                yield Fault(name, module, source_of(module), path.stem)


def sound() -> Iterator[Fault]:
    """Yield plugins without a fault."""
    for name, source in SOUND.items():
        yield Fault("nothing", f"{PACKAGES[0]}.{name}", source, name)


def checks_for(module: str) -> Iterator[Check]:
    """Yield what ``frobs check`` asks of a plugin, on MuJoCo: the quick first."""
    kind, planted = module.split(".")[1], importlib.import_module(module)
    if kind == "robot":
        yield from check_robot(planted.FAULTY, ["mujoco"])
        return
    common = {"name": "planted", "summary": planted.__doc__ or "", "entry_point": f"{module}:Faulty"}
    extended = _extended(kind, planted.Faulty)
    if kind == "controller":
        controller = ControllerRecord(**common)
        yield from check_controller(controller)
        yield from check_controller(controller, robot="kobuki" if extended == "differential_drive" else "irb120")
    elif kind == "simulator":
        levels = {Level.EXACT: planted.EXACT, Level.APPROXIMATE: planted.APPROXIMATE}
        capabilities = {name: level for level, names in levels.items() for name in names.split()}
        yield from check_simulator(SimulatorRecord(capabilities=capabilities, **common))
    elif kind == "task" and extended:
        task = replace(plugins.records("task")[extended], **common)
        yield from check_task(task)
        if hasattr(planted.Faulty, "compute_reward"):
            yield from check_task(task, reward_type="dense")
    elif kind == "task":
        from templates.my_drive import MyDrive
        from templates.my_rover import MY_ROVER

        drives = issubclass(planted.Faulty, MyDrive)
        task = TaskRecord(needs={"teleport": Level.APPROXIMATE}, **common)
        yield from check_task(
            task,
            robot=MY_ROVER if drives else "irb120",
            controller="differential_drive" if drives else "joint_delta_position",
        )
    else:
        from test_records import SHORT

        spaces = plugins.records("algorithm")[extended].action_spaces if extended else ("Box", "Discrete")
        yield from check_algorithm(AlgorithmRecord(action_spaces=spaces, **common), SHORT.get(extended))


def _extended(kind: str, faulty: type) -> str:
    """Return the name of the shipped part that a class extends, or an empty string for a template."""
    for cls in faulty.__mro__[1:]:
        for name, record in plugins.records(kind).items():
            module, _, attribute = record.entry_point.partition(":")
            if attribute == cls.__name__ and cls.__module__.startswith(module):
                return name
    return ""
