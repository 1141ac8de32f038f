"""``frobs ros2 run`` with ``frobs ros2 serve`` in another process."""

import json
import signal
from pathlib import Path
from typing import Any

import pytest
from loopback import measure_loopback, served_arm
from ros2_processes import Process, Start

pytestmark = pytest.mark.needs("ros2")

ID = "frobs/Irb120Reach-v0"
SIMULATED = ("--param", "use_sim_time:=true")


def ended(process: Process) -> Any:
    """End a node as Ctrl-C does, and return what it printed."""
    process.process.send_signal(signal.SIGINT)
    return process.result()


@pytest.mark.parametrize(("id", "episodes"), [(ID, 20), ("frobs/Ur5PickAndPlace-v0", 5), ("frobs/KobukiMaze-v0", 3)])
def test_policy_in_lockstep_succeeds_as_in_evaluate(ros2: Start, id: str, episodes: int) -> None:
    node = ros2("frobs", "ros2", "run", id, "--lockstep", "--json")
    result = ros2("frobs", "ros2", "serve", id, "--lockstep", "--episodes", episodes, "--json").result()
    assert result == {"episodes": episodes, "successes": episodes}  # as 'frobs evaluate' with these seeds
    report = ended(node)
    assert report["episodes"] == episodes
    assert report["late"] == 0
    assert not set(report["changed"]) - {"measurement"}


@pytest.mark.slow
def test_each_joint_state_at_200_hz_leads_to_a_command(ros2: Start, tmp_path: Path) -> None:
    for _ in range(3):  # on a busy machine, a process that stands still for 50 ms loses messages
        result = measure_loopback(ros2, tmp_path, 2_000)
        if result["arrived"] == result["sent"] == 2_000:
            return
    raise AssertionError(f"messages were lost: {result}")


def test_core_is_not_needed_and_trajectories_can_be_sent(ros2: Start, tmp_path: Path) -> None:
    from frobs_core.plugins.registry import pretrained_path

    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    script = (
        "import sys; sys.modules['frobs_core'] = sys.modules['gymnasium'] = None\n"
        "from frobs_ros2.policy_node.command_line import main; sys.exit(main(sys.argv[1:]))"
    )
    options = ("--goal", 0.3, 0.1, 0.5, "--interface", "trajectory", "--seconds", 3, "--max-age", 30)
    report = ros2("-c", script, pretrained_path(ID), *options, "--ros-args", "-p", "use_sim_time:=true").result()
    assert report["commands"] > 5


@pytest.mark.parametrize(
    ("served", "problems"),
    [
        ("frobs/Ur5Reach-v0", ["joint_states does not contain the joints joint_1"]),
        ("frobs/Irb140Reach-v0", ["joint 'joint_2' may move in", "has the velocity limit", "use_sim_time:=true"]),
    ],
)
def test_node_lists_what_to_change_for_another_robot(ros2: Start, served: str, problems: list[str]) -> None:
    ros2("frobs", "ros2", "serve", served).wait_for("serving")
    node = ros2("frobs", "ros2", "run", ID)
    node.result(status=2)
    text = "".join(node.errors)
    assert "change the following" in text
    assert [problem for problem in problems if problem not in text] == []


def test_dry_run_moves_nothing_and_the_dead_man_switch_makes_the_robot_hold(ros2: Start, tmp_path: Path) -> None:
    server = ros2("frobs", "ros2", "serve", ID)
    server.wait_for("serving")
    dry = ros2("frobs", "ros2", "run", ID, "--dry-run", *SIMULATED)
    dry.wait_for("would send position: joint_1=")
    ended(dry)
    log = tmp_path / "changes.jsonl"
    held = ros2("frobs", "ros2", "run", ID, "--deadman", "--log", log, "--json", *SIMULATED)
    held.wait_for("holding: the dead-man switch is not pressed")
    assert ended(held)["changed"]["dead-man"] >= 1
    assert json.loads(log.read_text("utf-8").splitlines()[0])["rule"] == "dead-man"


def test_node_holds_when_the_clock_stops(ros2: Start) -> None:
    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    node = ros2("frobs", "ros2", "run", ID, "--goal", 0.3, 0.1, 0.5, "--json", *SIMULATED)
    assert ros2("node", "pause_after_a_command.py").result() == "paused"
    node.wait_for("holding: no new joint state for 0.2 s")
    assert ended(node)["holds"] >= 1


@pytest.mark.slow
def test_faulty_joint_states_make_the_node_hold(ros2: Start, tmp_path: Path) -> None:
    node = ros2("frobs", "ros2", "run", ID, "--goal", 0.3, 0.1, 0.5, "--json")
    moved = ros2("node", "faults.py", "--period", 0.04, *served_arm(tmp_path)).result()
    assert set(moved) == {"late", "repeated", "reordered", "NaN", "jump", "lost"}
    assert max(moved.values()) < 0.1, moved
    report, errors = ended(node), "".join(node.errors)
    assert report["holds"] >= 6
    reasons = ("s old", "older than the one before", "is not finite", "jumped by", "no new joint state for 0.2 s")
    assert [reason for reason in reasons if reason not in errors] == []


def test_node_says_in_one_line_that_it_sees_no_robot(ros2: Start) -> None:
    node = ros2("frobs", "ros2", "run", ID, "--namespace", "nobody")
    node.result(status=2)
    assert "no node published /nobody/joint_states within 10 s" in "".join(node.errors)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("serve", ID, "--param", "real_time_factor:=2"), "real_time_factor must have a value such as 1.0"),
        (("serve", ID, "--remap", "bad"), "ROS 2 cannot start with --ros-args -r bad"),
        (("run", "missing.frobs"), "missing.frobs: the file cannot be read"),
    ],
    ids=["parameter", "rule", "file"],
)
def test_argument_that_cannot_be_used_is_one_line(ros2: Start, words: tuple[str, ...], message: str) -> None:
    process = ros2("frobs", "ros2", *words)
    process.result(status=2)
    text = "".join(process.errors)
    assert message in text
    assert "Traceback" not in text
