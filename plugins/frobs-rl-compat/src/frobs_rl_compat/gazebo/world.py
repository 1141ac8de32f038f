"""Resets, pauses and steps the simulation, and deletes models."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import ProcessError, ServiceError
from frobs_ros.ros.environment import child_variables, use_ros
from frobs_ros.ros.services import call, is_offered, patience

_STEP = "/gazebo/step"
_POLL = 0.0005


@answers(False)
def gazebo_reset_sim(retries: int = 5) -> bool:
    """Reset all models to their initial poses, and the clock to 0."""
    return _plain("reset_simulation", retries)


@answers(False)
def gazebo_reset_world(retries: int = 5) -> bool:
    """Reset all models to their initial poses, without resetting the clock."""
    return _plain("reset_world", retries)


@answers(False)
def gazebo_pause_physics(retries: int = 5) -> bool:
    """Pause the simulation."""
    return _plain("pause_physics", retries)


@answers(False)
def gazebo_unpause_physics(retries: int = 5) -> bool:
    """Resume the simulation."""
    return _plain("unpause_physics", retries)


@answers(False)
def gazebo_step_physics(steps: int = 1) -> bool:
    """Advance a paused simulation by a number of physics steps, and wait until the steps are complete.

    The bridge has a service that responds after the last step. Gazebo only has the command ``gz world -m``, which
    returns immediately, so this function then waits until the clock has reached the expected time.
    """
    if isinstance(steps, bool) or int(steps) != steps or steps < 1:
        raise ParameterValueError("steps", steps, "an integer of at least 1")
    if is_stepper_offered():
        from frobs_msgs.srv import StepWorld

        answer = call(_STEP, StepWorld, steps=int(steps))
        if not answer.success:
            raise ServiceError(_STEP, answer.status_message)
        return True
    return _step_by_command(int(steps))


@answers(False)
def gazebo_delete_model(model_name: str) -> bool:
    """Delete a model."""
    use_ros()
    from gazebo_msgs.srv import DeleteModel

    answer = call("/gazebo/delete_model", DeleteModel, model_name)
    if not answer.success:
        raise ServiceError("/gazebo/delete_model", f"'{model_name}': {answer.status_message}")
    return True


def is_stepper_offered() -> bool:
    """Return whether the simulation offers the bridge's step service, which responds after the last step."""
    from frobs_ros.ros.services import is_open

    return is_open(_STEP) or is_offered(_STEP)


def _plain(name: str, tries: int) -> bool:
    use_ros()
    from std_srvs.srv import Empty

    call(f"/gazebo/{name}", Empty, tries=tries)
    return True


def _world() -> Any:
    from gazebo_msgs.srv import GetPhysicsProperties, GetWorldProperties

    world = call("/gazebo/get_world_properties", GetWorldProperties)
    return world.sim_time, call("/gazebo/get_physics_properties", GetPhysicsProperties).time_step


def _step_by_command(steps: int) -> bool:
    variables = child_variables()
    program = shutil.which("gz", path=variables.get("PATH", os.defpath))
    if program is None:
        raise ProcessError("gz", "the program 'gz' is not installed; install Gazebo, which includes it")
    before, time_step = _world()
    done = subprocess.run([program, "world", "-m", str(steps)], env=variables, capture_output=True, text=True)
    if done.returncode:
        raise ProcessError("gz world", f"it failed with exit code {done.returncode}", done.stderr.strip())
    until = time.monotonic() + patience()
    while (now := _world()[0]) < before + (steps - 0.5) * time_step:
        if time.monotonic() > until:
            raise ServiceError(_STEP, f"'gz world -m {steps}' advanced the clock only from {before} s to {now} s")
        time.sleep(_POLL)
    return True
