"""Records of this distribution."""

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import EnvironmentRecord, RobotRecord, TaskRecord

INSTALL = "pip install frobs-tasks-lift-part"


@hookimpl
def frobs_robots() -> list[RobotRecord]:
    """Offer the gripper."""
    return [
        RobotRecord(
            name="pincer",
            summary="a gripper with two fingers that opens to 6 cm",
            entry_point="frobs_tasks_lift_part.pincer:PINCER",
            install_hint=INSTALL,
        )
    ]


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Offer the task and its ID."""
    return [
        TaskRecord(
            name="lift_part",
            summary="pick up a dumbbell",
            entry_point="frobs_tasks_lift_part.task:LiftPart",
            install_hint=INSTALL,
            needs={"teleport": Level.APPROXIMATE, "contacts": Level.APPROXIMATE},
            environments=(
                EnvironmentRecord(
                    id="lab/LiftPart-v0",
                    summary="the IRB 120 picks up a dumbbell",
                    robot="irb120+pincer",
                    controller="tcp_delta_pose",
                    max_episode_steps=100,
                    parameters={
                        "controller_kwargs": {
                            "max_delta": 0.02,
                            "axes": ["x", "y", "z"],
                            "target_low": [0.2, -0.3, 0.015],
                            "target_high": [0.5, 0.3, 0.4],
                        },
                        "simulator_kwargs": {"cone": "elliptic"},
                    },
                ),
            ),
        )
    ]
