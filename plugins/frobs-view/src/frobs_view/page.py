"""Writes a static page on which physics, controllers and policy run in the visitor's browser."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.models import JointType, joint_path
from frobs_core.util.errors import ConfigurationError, PolicyExportError
from frobs_core.util.files import write_text
from frobs_core.util.plain import to_json
from frobs_train import make_env

if TYPE_CHECKING:
    from frobs_train import BundleRun

FORMAT = 1
"""Version of ``page.json``, which ``page/src/simulation.js`` reads."""

FILES = Path(__file__).with_name("page_files")
"""Files that every page contains, from ``make page``."""

NAMES = (*("index.html", "style.css", "app.js", "mujoco.wasm.gz", "onnxruntime.wasm.gz", "THIRD_PARTY_LICENSES"),)
"""Names of these files."""

STARTS = 100
"""Number of initial states of a page."""

_GOAL = "goal"
_REACH = ("Reach", "ReachGoal")
_OBJECT = ("Lift", "PickAndPlace", "PickAndPlaceGoal", "Push", "PushGoal")
_TASKS = "frobs_tasks_"
"""Beginning of the packages that contain these tasks."""

_LAWS = (
    *("joint_delta_position", "tcp_delta_position", "tcp_delta_pose"),
    *("gripper_position", "gripper_delta", "gripper_binary"),
)
_STATES = ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat")


def write_page(run: BundleRun, folder: Path, starts: int = STARTS) -> dict[str, Any]:
    """Write a static page that runs a policy in its environment.

    Args:
        run: The policy bundle.
        folder: Folder to write. An earlier page in it is replaced.
        starts: Number of initial states among which the page chooses, ≥ 1.

    Returns:
        The folder, and the number and total size of its files [bytes].

    Raises:
        PolicyExportError: The page cannot show the environment or run the policy.
        ConfigurationError: The files of the page are missing, or the folder contains something else.
    """
    _check_files()
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / "page.json").is_file())):
        raise ConfigurationError(f"'{folder}' exists and is not a page; choose another folder for --page.")
    _refuse(run, _unsupported_settings(run))
    env: Any = make_env(run.config.environment, run.config.keywords(randomize=False)).unwrapped
    try:
        _refuse(run, _unsupported_parts(env))
        xml, arrays = env.simulation.export_mjcf()
        facts = {**_facts(run, env), "arrays": {name: array.reshape(len(array), -1) for name, array in arrays.items()}}
        facts |= _starts(env, starts)
    finally:
        env.close()
    folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        shutil.copyfile(FILES / name, folder / name)
    (folder / "policy.onnx").write_bytes(run.bundle.graph)
    write_text(folder / "POLICY_LICENSE", run.bundle.license)
    write_text(folder / "model.xml", xml)
    write_text(folder / "page.json", to_json(_finite(facts)))
    written = [path for path in folder.iterdir() if path.is_file()]
    return {"folder": folder, "files": len(written), "bytes": sum(path.stat().st_size for path in written)}


def _check_files() -> None:
    missing = [name for name in NAMES if not (FILES / name).is_file()]
    if missing:
        raise ConfigurationError(
            f"the files of the static page are missing: {', '.join(missing)}; run 'make page' in the checkout of FRobs, "
            "or install frobs-view from a wheel."
        )


def _refuse(run: BundleRun, reasons: Iterator[str]) -> None:
    found = list(reasons)
    if found:
        raise PolicyExportError(f"{run.path} as a page", "; ".join(found) + ".")


def _unsupported_settings(run: BundleRun) -> Iterator[str]:
    """Yield a reason for each setting of a training run that a page cannot repeat."""
    if run.config.randomize:
        names = ", ".join(map(str, run.config.randomize))
        yield f"the run randomizes its environment ({names}), and a page does not; train without 'randomize'"
    if run.config.wrappers:
        names = ", ".join(wrapper.name for wrapper in run.config.wrappers)
        yield f"the run wraps its environment ({names}); train without 'wrappers'"


def _unsupported_parts(env: Any) -> Iterator[str]:
    """Yield a reason for each part of an environment that a page does not support."""
    if not hasattr(env, "simulation"):
        yield "it was not trained in an environment of FRobs; choose an ID from 'frobs list envs'"
        return
    if not hasattr(env.simulation, "export_mjcf"):
        name = env.config.simulator
        yield f"a page simulates with MuJoCo, not with the simulator '{name}'; train with simulator=mujoco"
    if len(env.control.robots) > 1:
        yield f"a page has one robot, not {', '.join(env.control.robots)}; choose a task for one arm"
    if env.robot.robot.base != "fixed":
        yield f"a page has no robot with a {env.robot.robot.base} base; choose an arm"
    if _name(env.task) not in (*_REACH, *_OBJECT):
        yield f"a page does not know the task {type(env.task).__name__}; it knows {', '.join(_REACH + _OBJECT)}"
        return
    for name, controller in env.control.controllers.items():
        if controller.law().get("law") not in _LAWS:
            kind = type(controller).__name__
            yield f"a page does not know the controller {kind} of '{name}'; it knows {', '.join(_LAWS)}"
    known = _terms(env)
    for name, term in env.observations.terms.items():
        what = "camera picture" if term.view is not None else "observation term"
        if name not in known or not term.is_vector or name in env.config.observations:
            yield f"a page does not compute the {what} '{name}'; train without it"
    path = joint_path(env.robot.model, env.robot.frame_name("tcp"))
    if f"{env.robot.name}/{env.robot.tcp}" not in getattr(env.simulation, "body_ids", ()) or any(j.mimic for j in path):
        yield f"the joints between the base and the tool '{env.robot.tcp}' are coupled; choose another robot"


def _facts(run: BundleRun, env: Any) -> dict[str, Any]:
    """Return everything that the page needs besides the model and the initial states."""
    manifest, terms = run.bundle.manifest, _terms(env)
    keys = {term.key for term in env.observations.terms.values()}
    controllers, start = [], 0
    for name, controller in env.control.controllers.items():
        law = {**controller.law()}
        width = controller.action_space.shape[0]
        law["joints"] = [f"{env.robot.name}/{joint}" for joint in law["joints"]]
        law["body"] = f"{env.robot.name}/{law['frame']}" if "frame" in law else None
        controllers.append({**law, "name": name, "action": [start, start + width]})
        start += width
    camera = next((one for one in env.scene.cameras.values() if one.frame is None), None)
    space = env.action_space
    return {
        "format": FORMAT,
        "id": manifest["environment"]["id"].rpartition(":")[2],
        "robot": env.robot.robot.name,
        "instruction": env.task.instruction,
        "success_rule": env.task.success_rule,
        "training": {
            "algorithm": manifest["training"].get("algorithm"),
            "steps": run.steps,
            "success_rate": run.success_rate,
        },
        "control_timestep": env.control_timestep,
        "decimation": env.decimation,
        "max_episode_steps": manifest["environment"]["max_episode_steps"],
        "terms": [
            {**terms[name], "name": name, "key": term.key, "low": term.low, "high": term.high}
            for name, term in env.observations.terms.items()
        ],
        "dictionary": keys != {"observation"},
        "controllers": controllers,
        "action": {"low": space.low, "high": space.high},
        "success": _success(env),
        "tool": _tool(env),
        "camera": None if camera is None else {"pos": camera.pos, "target": camera.target, "fov_y": camera.fov_y},
    }


def _tool(env: Any) -> str:
    return f"{env.robot.name}/{env.robot.frame_name('tcp')}"


def _terms(env: Any) -> dict[str, dict[str, Any]]:
    """Return the kind of each known observation term of a task, and its settings, by name."""
    robot, task, tool = env.robot, env.task, _tool(env)
    if _name(task) in _REACH:
        joints = [f"{robot.name}/{joint}" for joint in robot.joint_names]
        path = joint_path(robot.model, robot.frame_name("tcp"))
        shoulder = next((joint.child for joint in path if joint.type is not JointType.FIXED), robot.model.root)
        to_goal = {"from": tool, "to": _GOAL}
        return {
            "joint_positions": {"kind": "joint_positions", "joints": joints},
            "joint_velocities": {"kind": "joint_velocities", "joints": joints},
            "tcp_position": _position(tool),
            "goal": _position(_GOAL),
            "goal_offset": {"kind": "offset", **to_goal},
            "goal_from_shoulder": {"kind": "offset_in_frame", **to_goal, "frame": f"{robot.name}/{shoulder}"},
            "achieved_goal": _position(tool),
            "desired_goal": _position(_GOAL),
        }
    gripper, body = robot.end_effector, task.body_name
    closed = np.array(list(gripper.closed.values()))
    to_tool, to_goal = {"from": tool, "to": body}, {"from": body, "to": _GOAL}
    return {
        "tcp_position": _position(tool),
        "tcp_velocity": {"kind": "velocity", "of": tool},
        "gripper_opening": {
            "kind": "opening",
            "joints": [f"{robot.name}/{joint}" for joint in gripper.closed],
            "closed": closed,
            "stroke": np.array([gripper.open[joint] for joint in gripper.closed]) - closed,
        },
        f"{body}_position": _position(body),
        f"{body}_orientation": {"kind": "axes", "of": body},
        f"{body}_velocity": {"kind": "velocity", "of": body},
        f"{body}_angular_velocity": {"kind": "angular_velocity", "of": body},
        f"{body}_offset": {"kind": "offset", **to_tool},
        f"{body}_offset_near": {"kind": "offset", **to_tool},
        "goal": _position(_GOAL),
        "goal_offset": {"kind": "offset", **to_goal},
        "goal_offset_near": {"kind": "offset", **to_goal},
        "achieved_goal": _position(body),
        "desired_goal": _position(_GOAL),
    }


def _position(of: str) -> dict[str, str]:
    return {"kind": "position", "of": of}


def _success(env: Any) -> dict[str, Any]:
    """Return the rule of success: a body near a point, at rest and at a height, for a number of control steps."""
    task, tool = env.task, _tool(env)
    conditioned = _name(task).endswith("Goal")  # such tasks compare float32 positions, at any speed
    rule = {"to": _GOAL, "heights": None, "max_speed": None, "hold_steps": 1, "rounded": conditioned}
    if _name(task) in _REACH:
        return {**rule, "of": tool, "tolerance": task.tolerance}
    rule |= {"of": task.body_name, "hold_steps": task.hold_steps}
    if not conditioned:
        rule["max_speed"] = task.max_speed
    if task.shows_goal:
        return {**rule, "tolerance": task.tolerance}
    heights = [task.rest_height + task.lowest, task.rest_height + task.highest]
    return {**rule, "to": tool, "heights": heights, "tolerance": max(task.size / 2, abs(task.grasp.closed_at))}


def _starts(env: Any, count: int) -> dict[str, Any]:
    """Return initial states: the arrays that are equal in all of them, and the others for each."""
    states = []
    for seed in range(count):
        env.reset(seed=seed)
        state = {name: env.simulation.states[name][0].ravel().copy() for name in _STATES}
        states.append({**state, _GOAL: env.task.goal[0].copy()})
    common = {
        name: first for name, first in states[0].items() if all(np.array_equal(first, state[name]) for state in states)
    }
    goals = np.array([state[_GOAL] for state in states])
    shown = any(marker.name == _GOAL for marker in env.task.markers())
    return {
        "goal": {"low": goals.min(axis=0), "high": goals.max(axis=0)} if shown else None,
        "start": common,
        "starts": [{name: value for name, value in state.items() if name not in common} for state in states],
    }


def _name(task: Any) -> str:
    """Return the name of a task's class, or an empty text for tasks of other packages."""
    return type(task).__name__ if type(task).__module__.startswith(_TASKS) else ""


def _finite(value: Any) -> Any:
    """Replace infinite limits, which JSON cannot represent, by the largest numbers."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, np.ndarray | float):
        return np.clip(np.asarray(value, float), -sys.float_info.max, sys.float_info.max)
    return value
