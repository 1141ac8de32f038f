"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import EnvironmentRecord, TaskRecord


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Offer the task, with an arm, a controller and a simulator of others."""
    scara = EnvironmentRecord(
        id="acme/ScaraTouch-v0",
        summary="A planar arm touches a point",
        robot="scara",
        controller="smooth",
        simulator="ideal",
        max_episode_steps=60,
    )
    return [
        TaskRecord(
            name="touch",
            summary="Bring the tool to a point, once",
            entry_point="acme_task_touch.touch:Touch",
            install_hint="pip install acme-task-touch",
            environments=(scara,),
        )
    ]
