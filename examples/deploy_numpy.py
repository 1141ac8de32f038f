"""Export a policy, and run it with NumPy and onnxruntime, as a robot's computer would.

`export_policy` runs on the training machine. `run_policy` imports neither PyTorch nor a simulator. The robot is
represented by a function that takes an action and returns the next observation. In this example, a simulated arm
replaces the robot. The script prints the terms of the policy's observation, the distance between tool and goal after
every tenth action, and the latency of the policy.

Requires: pip install frobs

The robot's computer requires only: pip install frobs-deploy
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 40_000
Observation = NDArray[np.float32]


def export_policy(file: Path) -> None:
    """Train a policy, and write it to a file."""
    from frobs_train import resolve_config, train
    from frobs_train.export.export import export

    flags = {"controller": "tcp_delta_position", "seed": 0, "steps": STEPS}
    run = train(resolve_config("frobs/Irb120Reach-v0", flags=flags), file.with_suffix(""), on_existing="overwrite")
    export(run, file, license="MIT")


def run_policy(file: Path, observation: Observation, step: Callable[[NDArray[np.float32]], Observation]) -> None:
    """Control a robot with the policy for two seconds."""
    from frobs_deploy import Policy

    policy = Policy(file, control_timestep=0.04)
    terms = policy.bundle.manifest["observation"]["terms"]
    print("observation:", ", ".join(f"{term['name']} [{term['unit']}]" for term in terms))
    (offset,) = (slice(*term["columns"]) for term in terms if term["name"] == "goal_offset")

    policy.reset()
    for number in range(1, 51):
        observation = step(policy.act(observation))
        if number % 10 == 0:
            distance = np.linalg.norm(observation[offset])
            print(f"action {number}: {100 * distance:5.1f} cm from the goal")
    print(policy.latency)


if __name__ == "__main__":
    import gymnasium as gym

    bundle = Path("runs/examples/deploy.frobs")
    export_policy(bundle)
    robot = gym.make("frobs_core:frobs/Irb120Reach-v0", controller="tcp_delta_position")
    first, _ = robot.reset(seed=3)
    run_policy(bundle, first, lambda action: robot.step(action)[0])
    robot.close()
