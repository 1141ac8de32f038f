"""Records of this distribution."""

from collections.abc import Mapping

from frobs_core.capabilities import Level
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import EnvironmentRecord, TaskRecord

_INSTALL = "pip install frobs-tasks-reach"
_NEEDS = {"teleport": Level.APPROXIMATE}
_IRB120_GOALS = {"goal_low": (-0.5, -0.5, 0.0), "goal_high": (0.5, 0.5, 1.0)}  # [m] FRobs_RL's


def _irb120(
    id: str,
    summary: str,
    max_episode_steps: int = 50,
    goal_box: Mapping[str, object] = _IRB120_GOALS,
    **parameters: object,
) -> EnvironmentRecord:
    return EnvironmentRecord(
        id=id,
        summary=summary,
        robot="irb120",
        controller="joint_delta_position",
        max_episode_steps=max_episode_steps,
        parameters={**goal_box, **parameters},
    )


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Offer the reaching tasks."""
    return [
        TaskRecord(
            name="reach",
            summary="hold the tool centre point at a goal that stands still",
            entry_point="frobs_tasks_reach.reach:Reach",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(
                _irb120("frobs/Irb120Reach-v0", "IRB 120 holds its tool at a goal"),
                EnvironmentRecord(
                    id="frobs/Reach-v0",
                    summary="any arm, named or a model file, holds its tool at a goal: give it with robot=…",
                    robot="",
                    controller="tcp_delta_position",
                    max_episode_steps=100,
                ),
            ),
        ),
        TaskRecord(
            name="reach_dynamic",
            summary="keep the tool centre point at a goal that moves",
            entry_point="frobs_tasks_reach.dynamic:ReachDynamic",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(_irb120("frobs/Irb120ReachDynamic-v0", "IRB 120 follows a moving goal", 100),),
        ),
        TaskRecord(
            name="reach_goal",
            summary="reach, goal-conditioned: for hindsight experience replay",
            entry_point="frobs_tasks_reach.goal:ReachGoal",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(_irb120("frobs/Irb120ReachGoal-v0", "IRB 120 reach, goal-conditioned"),),
        ),
        TaskRecord(
            name="reach_legacy",
            summary="reach as FRobs_RL had it: its observation, reward and ends, and its task YAML",
            entry_point="frobs_tasks_reach.legacy:ReachLegacy",
            install_hint=_INSTALL,
            needs=_NEEDS,
            environments=(
                _irb120(
                    "frobs/Irb120ReachLegacy-v0",
                    "IRB 120 reach as FRobs_RL had it",
                    100,
                    goal_box={},
                    controller_kwargs={"full_range": True},
                ),
            ),
        ),
    ]
