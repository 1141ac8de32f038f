"""Plugin records of this distribution."""

import re
from dataclasses import replace
from typing import Any

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import EnvironmentRecord, SimulatorDefaults, TaskRecord

_INSTALL = "pip install frobs-tasks-manipulation"
_ARMS = {"Panda": ("panda", "Panda"), "Ur5": ("ur5_gripper", "UR5 with a parallel gripper")}
"""Robot name and readable name of each arm, by the prefix of its environment IDs."""

_PRETRAINED = (
    "PandaLift",
    "PandaOpenDoor",
    "PandaOpenDrawer",
    "PandaPegInsertion",
    "PandaPegInsertionTight",
    "PandaPickAndPlace",
    "PandaPickAndPlaceGoal",
    "PandaPickAndPlaceVision",
    "PandaPush",
    "PandaPushGoal",
    "PandaPushVision",
    "PandaSlide",
    "PandaSlideGoal",
    "PandaStack",
    "PandaStackVision",
    "Ur5Lift",
    "Ur5OpenDoor",
    "Ur5OpenDrawer",
    "Ur5PegInsertion",
    "Ur5PegInsertionTight",
    "Ur5PickAndPlace",
    "Ur5PickAndPlaceGoal",
    "Ur5Push",
    "Ur5PushGoal",
    "Ur5Slide",
    "Ur5SlideGoal",
    "Ur5Stack",
)
"""Environments with a pretrained policy, which ``tests/benchmarks/pretrained.py`` trains."""

_GOAL_MAX_DELTA = 0.05
"""Step size [m] as in panda-gym, which is large enough to grasp a cube and carry it to a goal in 50 steps."""


def _pretrained(name: str) -> str:
    return f"frobs_tasks_manipulation:pretrained/{name.lower()}.frobs" if name in _PRETRAINED else ""


def _task(
    entry_point: str, summary: str, steps: int, algorithm: str = "ppo", **arm_controller: float | bool
) -> TaskRecord:
    """Return the record of a task with one environment for each arm.

    The class's name in ``entry_point`` is the last part of the environment IDs and, in lower case with underscores, the
    name of the task. An episode has at most ``steps`` control steps.
    """
    title = entry_point.partition(":")[2]
    return TaskRecord(
        name=re.sub(r"(?<=.)(?=[A-Z])", "_", title).lower(),
        summary=summary,
        entry_point=f"frobs_tasks_manipulation.{entry_point}",
        install_hint=_INSTALL,
        environments=tuple(
            EnvironmentRecord(
                id=f"frobs/{arm}{title}-v0",
                summary=f"{words} must {summary}",
                robot=robot,
                controller="tcp_delta_pose",
                max_episode_steps=steps,
                pretrained=_pretrained(f"{arm}{title}"),
                algorithm=algorithm,
                parameters={
                    "controller_kwargs": {
                        "max_delta": 0.02,
                        "axes": ["x", "y", "z"],
                        "target_low": [0.2, -0.4, 0.01],
                        "target_high": [0.8, 0.4, 0.5],
                        **arm_controller,
                    },
                    "simulator_kwargs": {"cone": "elliptic"},
                },
            )
            for arm, (robot, words) in _ARMS.items()
        ),
    )


def _with_tight_hole(task: TaskRecord) -> TaskRecord:
    """Add an environment with a hole clearance of 0.5 mm for each arm."""
    tight = tuple(
        replace(
            each,
            id=f"frobs/{arm}PegInsertionTight-v0",
            summary=f"{each.summary} that is 0.5 mm wider",
            pretrained=_pretrained(f"{arm}PegInsertionTight"),
            parameters={**each.parameters, "clearance": 0.0005},
            algorithm="dagger",
        )
        for arm, each in zip(_ARMS, task.environments, strict=True)
    )
    return replace(task, environments=(*task.environments, *tight))


def _for_any_arm(task: TaskRecord) -> TaskRecord:
    """Add an environment for the arm with a gripper that the user passes, such as a model file."""
    title = task.entry_point.partition(":")[2]
    generic = EnvironmentRecord(
        id=f"frobs/{title}-v0",
        summary=f"an arm with a gripper must {task.summary}; pass robot=",
        robot="",
        controller="tcp_delta_pose",
        max_episode_steps=2 * task.environments[0].max_episode_steps,
        algorithm="dagger",
        parameters={
            "fit": True,
            "controller_kwargs": {"axes": ["x", "y", "z"]},
            # Without it, an object creeps out of jaws that turn.
            "simulator_kwargs": SimulatorDefaults({"cone": "elliptic"}, mujoco={"impratio": 100}),
        },
    )
    return replace(task, environments=(*task.environments, generic))


_EYES = {name: {"camera": camera, "size": [64, 64]} for name, camera in (("scene", "overview"), ("wrist", "wrist"))}
"""Observation terms with the pictures of a fixed camera and of the wrist camera."""


def _with_eyes(task: TaskRecord, *hidden: str, **changed: float) -> TaskRecord:
    """Add an environment of the Panda in which pictures replace the observation terms ``hidden``.

    The parameters ``changed`` differ from those of the environment with these terms.
    """
    of_state = task.environments[0]
    name = f"{of_state.id.removeprefix('frobs/').removesuffix('-v0')}Vision"
    parameters = {**of_state.parameters, **changed, "observations": {**dict.fromkeys(hidden), **_EYES}}
    seeing = replace(
        of_state,
        id=f"frobs/{name}-v0",
        summary=f"{of_state.summary}, seen by two cameras",
        pretrained=_pretrained(name),
        parameters=parameters,
        algorithm="dagger",
    )
    return replace(task, environments=(*task.environments, seeing))


_CUBE = ("cube_position", "cube_orientation", "cube_velocity", "cube_angular_velocity", "cube_offset", "goal_offset")
"""Observation terms that no robot measures, in tasks with a cube."""

_CUBES = (
    *_CUBE,
    *("cube_offset_near", "goal_offset_near"),
    *("base_position", "base_orientation", "base_velocity", "base_angular_velocity"),
)
_HANDLE = ("handle_position", "handle_direction", "handle_offset", "joint_position", "joint_velocity", "target_offset")
_PICK = "bring a cube to a goal; half of the goals are in the air"


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Return the records of the manipulation tasks."""
    slide = "hit a puck so that it slides to a goal out of reach"
    slide_arm: dict[str, Any] = {"max_delta": 0.04, "interpolate": True}
    goal = "(goal-conditioned)"
    return [
        _for_any_arm(_with_eyes(_task("push:Push", "push a cube to a goal on the floor", 125), *_CUBE)),
        _task("slide:Slide", slide, 100, **slide_arm),
        _task("slide:SlideGoal", f"{slide} {goal}", 100, "dagger", **slide_arm),
        _task("push:PushGoal", f"push a cube to a goal on the floor {goal}", 100, "dagger", max_delta=_GOAL_MAX_DELTA),
        _for_any_arm(_task("lift:Lift", "grasp a cube and hold it in the air", 75)),
        _for_any_arm(_with_eyes(_task("pick_and_place:PickAndPlace", _PICK, 100), *_CUBE)),
        _task(
            "pick_and_place:PickAndPlaceGoal",
            f"bring a cube to a goal {goal}; most of the goals are in the air",
            50,
            max_delta=_GOAL_MAX_DELTA,
        ),
        _for_any_arm(_with_eyes(_task("stack:Stack", "put a cube on another cube and release it", 125), *_CUBES)),
        _with_tight_hole(_task("peg_insertion:PegInsertion", "put a peg into a hole", 300)),
        _with_eyes(
            _task("open_task:OpenDrawer", "pull a drawer open to a target distance", 85),
            *_HANDLE,
            lowest=0.15,
            highest=0.15,
        ),
        _task("open_task:OpenDoor", "pull a door open to a target angle", 90),
    ]
