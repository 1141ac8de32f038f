"""Records of the parts that this distribution provides. This module imports only lightweight modules."""

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import EnvironmentRecord, TaskRecord


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Provide the task and a Gymnasium ID that combines the task with a robot and a controller."""
    return [
        TaskRecord(
            name="my_arm_reach",
            summary="hold the tool center point at a goal",
            entry_point="frobs_tasks_my_arm.task:MyArmReach",
            install_hint="pip install frobs-tasks-my-arm",
            needs={"teleport": Level.APPROXIMATE},
            environments=(
                EnvironmentRecord(
                    id="acme/MyArmReach-v0",
                    summary="my_arm holds its tool at a goal",
                    robot="my_arm",
                    controller="joint_delta_position",
                    max_episode_steps=50,
                ),
            ),
        )
    ]
