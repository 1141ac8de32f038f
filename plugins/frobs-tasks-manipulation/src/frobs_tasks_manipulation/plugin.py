"""Plugin records of this distribution."""

from dataclasses import replace

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import EnvironmentRecord, TaskRecord

_INSTALL = "pip install frobs-tasks-manipulation"
_ARMS = {"Panda": ("panda", "Panda"), "Ur5": ("ur5_gripper", "UR5 with a parallel gripper")}
"""Robot name and readable name of each arm, by the prefix of its environment IDs."""

_PRETRAINED = (
    "PandaLift",
    "PandaOpenDoor",
    "PandaOpenDrawer",
    "PandaPegInsertion",
    "PandaPickAndPlace",
    "PandaPush",
    "PandaSlide",
    "PandaStack",
    "Ur5OpenDrawer",
)
"""Environments with a pretrained policy, which ``tests/benchmarks/pretrained.py`` trains."""

_GOAL_MAX_DELTA = 0.05
"""Step size [m] as in panda-gym, which is large enough to grasp a cube and carry it to a goal in 50 steps."""


def _pretrained(name: str) -> str:
    return f"frobs_tasks_manipulation:pretrained/{name.lower()}.frobs" if name in _PRETRAINED else ""


def _task(
    name: str, title: str, entry_point: str, summary: str, steps: int, **arm_controller: float | bool
) -> TaskRecord:
    """Return the record of a task with one environment for each arm.

    Args:
        name: Name of the task.
        title: Last part of the environment IDs.
        entry_point: ``"module:class"`` in this package.
        summary: Short description of what the robot must do.
        steps: Maximum length of an episode [control steps].
        arm_controller: Additional parameters of the arm's controller.
    """
    return TaskRecord(
        name=name,
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
        )
        for arm, each in zip(_ARMS, task.environments, strict=True)
    )
    return replace(task, environments=(*task.environments, *tight))


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Return the records of the manipulation tasks."""
    return [
        _task("push", "Push", "push:Push", "push a cube to a goal on the floor", 125),
        _task(
            "slide",
            "Slide",
            "slide:Slide",
            "hit a puck so that it slides to a goal out of reach",
            100,
            max_delta=0.04,
            interpolate=True,
        ),
        _task(
            "slide_goal",
            "SlideGoal",
            "slide:SlideGoal",
            "hit a puck so that it slides to a goal out of reach (goal-conditioned)",
            100,
            max_delta=0.04,
            interpolate=True,
        ),
        _task(
            "push_goal",
            "PushGoal",
            "push:PushGoal",
            "push a cube to a goal on the floor (goal-conditioned)",
            100,
            max_delta=_GOAL_MAX_DELTA,
        ),
        _task("lift", "Lift", "lift:Lift", "grasp a cube and hold it in the air", 75),
        _task(
            "pick_and_place",
            "PickAndPlace",
            "pick_and_place:PickAndPlace",
            "bring a cube to a goal; half of the goals are in the air",
            100,
        ),
        _task(
            "pick_and_place_goal",
            "PickAndPlaceGoal",
            "pick_and_place:PickAndPlaceGoal",
            "bring a cube to a goal (goal-conditioned); most of the goals are in the air",
            50,
            max_delta=_GOAL_MAX_DELTA,
        ),
        _task("stack", "Stack", "stack:Stack", "put a cube on another cube and release it", 125),
        _with_tight_hole(
            _task("peg_insertion", "PegInsertion", "peg_insertion:PegInsertion", "put a peg into a hole", 300)
        ),
        _task("open_drawer", "OpenDrawer", "open_drawer:OpenDrawer", "pull a drawer open to a target distance", 85),
        _task("open_door", "OpenDoor", "open_door:OpenDoor", "pull a door open to a target angle", 90),
    ]
