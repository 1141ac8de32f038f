"""Records of this distribution."""

from dataclasses import replace

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord

_MODEL_FILES = {".zip": "frobs_algos_sb3.model_files.policy:open_policy"}

_STILL_GOALS = ("Ur5Reach", "Irb120ReachVelocity", "Ur5ReachVelocity")
_MOVING_GOALS = ("Irb120ReachDynamic", "Irb140ReachDynamic", "Ur5ReachDynamic")
_LEGACY_REACHERS = ("Irb120ReachLegacy", "Irb140ReachLegacy", "Ur5ReachLegacy")
_LEGACY_KOBUKIS = ("KobukiEmptyLegacy", "KobukiDynamicLegacy", "KobukiMazeLegacy")
_CONDITIONED = ("Irb120ReachGoal", "Irb140ReachGoal", "Ur5ReachGoal")

_ARMS_WITH_GRIPPERS = ("Panda", "Ur5")

_ANY = ("Box", "Discrete", "MultiDiscrete", "MultiBinary")


def _for_arms(**files: str) -> dict[str, str]:
    """Return the files with tuned settings for manipulation tasks, by environment ID. All arms share the same files."""
    return {f"{arm}{task}": file for task, file in files.items() for arm in _ARMS_WITH_GRIPPERS}


def _record(name: str, cls: str, summary: str, action_spaces: tuple[str, ...], **tuned: str) -> AlgorithmRecord:
    """Return a record. ``tuned`` maps IDs without ``frobs/`` and ``-v0`` to files in the folder ``tuned``."""
    return AlgorithmRecord(
        name=name,
        summary=summary,
        entry_point=f"frobs_algos_sb3.{name}:{cls}",
        install_hint="pip install frobs-algos-sb3",
        action_spaces=action_spaces,
        tuned={f"frobs/{key}-v0": f"frobs_algos_sb3:tuned/{file}" for key, file in tuned.items()},
        search_space=f"frobs_algos_sb3:search/{name}.yaml",
        model_files=_MODEL_FILES,
    )


def _contrib(name: str, cls: str, summary: str, action_spaces: tuple[str, ...]) -> AlgorithmRecord:
    record = _record(name, cls, summary, action_spaces)
    return replace(record, install_hint="pip install 'frobs-algos-sb3[contrib]'", search_space="")


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Return the records of the algorithms."""
    return [
        _record(
            "ppo",
            "PPO",
            "proximal policy optimization",
            _ANY,
            Irb120Reach="ppo_irb120_reach.yaml",
            Reach="ppo_reach.yaml",
            **dict.fromkeys(_STILL_GOALS, "ppo_reach_arm.yaml"),
            Irb140Reach="ppo_irb140_reach.yaml",
            Irb140ReachVelocity="ppo_irb140_reach_velocity.yaml",
            **dict.fromkeys(_MOVING_GOALS, "ppo_reach_dynamic.yaml"),
            **dict.fromkeys(_LEGACY_REACHERS, "ppo_reach_legacy.yaml"),
            KobukiEmpty="ppo_kobuki_empty.yaml",
            KobukiDynamic="ppo_kobuki_dynamic.yaml",
            KobukiMaze="ppo_kobuki_maze.yaml",
            Navigate="ppo_navigate.yaml",
            **dict.fromkeys(_LEGACY_KOBUKIS, "ppo_navigate_legacy.yaml"),
            **_for_arms(
                Push="ppo_push.yaml",
                Slide="ppo_slide.yaml",
                Lift="ppo_lift.yaml",
                PickAndPlace="ppo_pick_and_place.yaml",
                Stack="ppo_stack.yaml",
                PegInsertion="ppo_peg_insertion.yaml",
                OpenDrawer="ppo_open.yaml",
                OpenDoor="ppo_open.yaml",
                PickAndPlaceGoal="ppo_pick_and_place_goal.yaml",
            ),
        ),
        _record("a2c", "A2C", "advantage actor-critic", _ANY),
        _record("ddpg", "DDPG", "deep deterministic policy gradient", ("Box",)),
        _record("dqn", "DQN", "deep Q network", ("Discrete",), Irb120Reach="dqn_irb120_reach.yaml"),
        _record(
            "sac",
            "SAC",
            "soft actor-critic",
            ("Box",),
            Irb120Reach="sac_irb120_reach.yaml",
            **dict.fromkeys(_CONDITIONED, "sac_reach_goal.yaml"),
            **_for_arms(PushGoal="sac_push_goal.yaml"),
        ),
        _record(
            "td3",
            "TD3",
            "twin delayed deep deterministic policy gradient",
            ("Box",),
            Irb120Reach="td3_irb120_reach.yaml",
            Irb140ReachVelocityLegacy="td3_irb140_reach_velocity_legacy.yaml",
        ),
        _contrib("tqc", "TQC", "truncated quantile critics, from sb3-contrib", ("Box",)),
        _contrib("crossq", "CrossQ", "batch normalization instead of target networks, from sb3-contrib", ("Box",)),
        _contrib("recurrent_ppo", "RecurrentPPO", "PPO with a recurrent policy, from sb3-contrib", _ANY),
    ]
