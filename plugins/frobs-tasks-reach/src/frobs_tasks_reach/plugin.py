"""Plugin records of this distribution."""

from dataclasses import dataclass

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import EnvironmentRecord, TaskRecord

_INSTALL = "pip install frobs-tasks-reach"


@dataclass(frozen=True, kw_only=True)
class _Arm:
    """Arm with its goal box.

    Attributes:
        id: Prefix of the arm's environment IDs.
        robot: Name of the robot.
        title: Name of the arm for use in sentences.
        goal_low: Minimum corner of the arm's goal box [m].
        goal_high: Maximum corner of the arm's goal box [m].
    """

    id: str
    robot: str
    title: str
    goal_low: tuple[float, float, float]
    goal_high: tuple[float, float, float]

    def environment(
        self,
        what: str,
        summary: str,
        *,
        max_episode_steps: int = 50,
        controller: str = "joint_delta_position",
        algorithm: str = "ppo",
        **parameters: object,
    ) -> EnvironmentRecord:
        """Return the record of ``frobs/{id}{what}-v0``, whose policy ``tests/benchmarks/pretrained.py`` trains."""
        name = f"{self.id}{what}"
        goal_box = {"goal_low": self.goal_low, "goal_high": self.goal_high}
        return EnvironmentRecord(
            id=f"frobs/{name}-v0",
            summary=f"{self.title} {summary}",
            robot=self.robot,
            controller=controller,
            max_episode_steps=max_episode_steps,
            parameters={**goal_box, **parameters},
            pretrained=f"frobs_tasks_reach:pretrained/{name.lower()}.frobs",
            algorithm=algorithm,
        )


# The goal boxes are the same as in FRobs_RL, except that the box of the IRB 140 (±1, ±1, 0 to 2 m) is reduced to
# reachable positions.
_IRB120 = _Arm(id="Irb120", robot="irb120", title="IRB 120", goal_low=(-0.5, -0.5, 0.0), goal_high=(0.5, 0.5, 1.0))
_IRB140 = _Arm(id="Irb140", robot="irb140", title="IRB 140", goal_low=(-0.9, -0.9, 0.0), goal_high=(0.9, 0.9, 1.2))
_UR5 = _Arm(id="Ur5", robot="ur5", title="UR5", goal_low=(0.0, -0.5, 0.2), goal_high=(0.7, 0.5, 1.0))
_ARMS = (_IRB120, _IRB140, _UR5)

_ANY_ARM = EnvironmentRecord(
    id="frobs/Reach-v0",
    summary="an arm of your choice holds its tool at a goal; set robot=… to a robot name or a model file",
    robot="",
    controller="tcp_delta_position",
    max_episode_steps=100,
)


def _task(name: str, cls: str, summary: str, *environments: EnvironmentRecord) -> TaskRecord:
    return TaskRecord(
        name=name,
        summary=summary,
        entry_point=f"frobs_tasks_reach.{cls}",
        install_hint=_INSTALL,
        environments=environments,
    )


@hookimpl
def frobs_tasks() -> list[TaskRecord]:
    """Return the records of the reaching tasks."""
    return [
        _task(
            "reach",
            "reach:Reach",
            "hold the tool center point at a fixed goal",
            *(arm.environment("Reach", "holds its tool at a goal") for arm in _ARMS),
            *(
                arm.environment(
                    "ReachVelocity",
                    "holds its tool at a goal with joint velocity commands",
                    controller="joint_velocity",
                )
                for arm in _ARMS
            ),
            _ANY_ARM,
        ),
        _task(
            "reach_dynamic",
            "dynamic:ReachDynamic",
            "keep the tool center point at a moving goal",
            *(arm.environment("ReachDynamic", "follows a moving goal", max_episode_steps=100) for arm in _ARMS),
        ),
        _task(
            "reach_goal",
            "goal:ReachGoal",
            "hold the tool center point at a fixed goal (goal-conditioned, for hindsight experience replay)",
            *(
                arm.environment("ReachGoal", "holds its tool at a goal (goal-conditioned)", algorithm="sac")
                for arm in _ARMS
            ),
        ),
        _task(
            "reach_together",
            "together:ReachTogether",
            "hold the tool center points of several arms, each at its own goal",
        ),
    ]
