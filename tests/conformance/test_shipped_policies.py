"""Every trained policy that comes with an ID: whole, and as good as it says.

The check ``pretrained_policies_fit`` in ``test_records.py`` tests that it fits the current version of the ID.
"""

from __future__ import annotations

import pytest

from frobs_core.plugins import registry
from frobs_core.plugins.registry import pretrained_ids
from frobs_train import evaluate, open_pretrained, resolve_config
from frobs_train.evaluation.evaluate import wilson_interval
from frobs_train.export.pretrained import claimed_evaluation, describe_pretrained, read_pretrained

SHIPPED = pretrained_ids()
QUICK = {"frobs/Irb120Reach-v0", "frobs/KobukiDynamic-v0"}
MANIPULATION = {
    "frobs/PandaLift-v0",
    "frobs/PandaOpenDoor-v0",
    "frobs/PandaOpenDrawer-v0",
    "frobs/PandaPegInsertion-v0",
    "frobs/PandaPegInsertionTight-v0",
    "frobs/PandaPickAndPlace-v0",
    "frobs/PandaPickAndPlaceGoal-v0",
    "frobs/PandaPickAndPlaceVision-v0",
    "frobs/PandaPush-v0",
    "frobs/PandaPushGoal-v0",
    "frobs/PandaPushVision-v0",
    "frobs/PandaSlide-v0",
    "frobs/PandaSlideGoal-v0",
    "frobs/PandaStack-v0",
    "frobs/PandaStackVision-v0",
    "frobs/Ur5Lift-v0",
    "frobs/Ur5OpenDoor-v0",
    "frobs/Ur5OpenDrawer-v0",
    "frobs/Ur5PegInsertion-v0",
    "frobs/Ur5PegInsertionTight-v0",
    "frobs/Ur5PickAndPlace-v0",
    "frobs/Ur5PickAndPlaceGoal-v0",
    "frobs/Ur5Push-v0",
    "frobs/Ur5PushGoal-v0",
    "frobs/Ur5Slide-v0",
    "frobs/Ur5SlideGoal-v0",
    "frobs/Ur5Stack-v0",
}
"""The manipulation IDs that have one so far."""

NETWORK = ("policy_kwargs", "net_arch", "history")
"""Settings of the algorithms that decide the shape of a policy."""


def test_one_comes_with_every_id_that_has_a_robot_but_manipulation() -> None:
    wanted = {
        id
        for id, (task, record) in registry.environments().items()
        if record.robot and id.startswith("frobs/") and "manipulation" not in task.entry_point
    }
    assert set(SHIPPED) == wanted | MANIPULATION


@pytest.mark.parametrize("id", SHIPPED)
def test_it_tells_licence_command_commit_and_what_it_reaches(id: str) -> None:
    bundle = read_pretrained(id)  # proves the checksums
    told = describe_pretrained(bundle)
    assert told["license"] == "MIT"
    assert "MIT" in bundle.license
    assert told["command"].startswith(f"frobs train {id}")
    assert len(told["commit"]) == 40
    assert told["seconds"] > 0.0
    assert told["episodes"] >= 250
    low, high = told["success_interval"]
    assert 0.0 <= low <= told["success_rate"] <= high <= 1.0
    assert told["bytes"] < (5_000_000 if "Vision" in id else 1_000_000)


@pytest.mark.parametrize("id", [id if id in QUICK else pytest.param(id, marks=pytest.mark.slow) for id in SHIPPED])
def test_it_acts_in_its_environment(id: str) -> None:
    found = evaluate(open_pretrained(id), 4)
    claimed = claimed_evaluation(read_pretrained(id))
    assert claimed is not None
    assert found.episodes == 4
    assert found.success_rate is not None
    if claimed["success_rate"] > 0.9:
        assert found.success_rate >= 0.5


@pytest.mark.slow
@pytest.mark.parametrize("id", SHIPPED)
def test_it_is_as_good_as_it_says(id: str) -> None:
    longest = registry.environments()[id][1].max_episode_steps
    episodes = min(200, 30_000 // longest)
    found = evaluate(open_pretrained(id), episodes, seed=12345)
    claimed = claimed_evaluation(read_pretrained(id))
    assert claimed is not None
    assert found.success_rate is not None
    lowest, _ = wilson_interval(round(claimed["success_rate"] * episodes), episodes)
    assert found.success_rate >= lowest - 0.02
    if claimed["tracking_error"] is not None:
        assert found.tracking_error is not None
        assert found.tracking_error <= claimed["tracking_error"] + 0.005  # one goal missed by 1 m in 200


@pytest.mark.slow
@pytest.mark.parametrize("id", SHIPPED)
def test_it_was_trained_with_what_is_tuned(id: str) -> None:
    run = open_pretrained(id)
    flags = {"algorithm": run.config.algorithm, "seed": run.config.seed}
    tuned = resolve_config(id, flags=flags)
    assert tuned.environment_kwargs == run.config.environment_kwargs
    assert set(NETWORK) & set(tuned.algorithm_config), "the network is set by none of these settings"
    for key in NETWORK:
        assert tuned.algorithm_config.get(key) == run.config.algorithm_config.get(key), key
