"""Acts in an environment whose simulator is ``ros2``, and prints what happened."""

import json
import sys

import gymnasium as gym
import numpy as np

from frobs_core import load_policy
from frobs_core.util.errors import SimulationError

ID = sys.argv[1]
kwargs = {"safety": {"slow_start": 0.1, "max_age": 5.0}, "homing_speed": 2.0}
kwargs |= {"cameras": {"overview": "/overview/image_raw"}}
if "--wall-clock" in sys.argv:
    kwargs["use_sim_time"] = False
try:
    env = gym.make(f"frobs_core:{ID}", simulator="ros2", simulator_kwargs=kwargs, disable_env_checker=True)
except SimulationError as error:
    print(json.dumps({"error": str(error)}))
    sys.exit()
policy = load_policy("pretrained", env.unwrapped)
successes, errors, info = 0.0, [], {}
for seed in range(2):
    observation, _ = env.reset(seed=seed)
    robot = env.unwrapped.robot
    errors.append(float(abs(robot.joint_positions - robot.home).max()))
    start = np.array([True])
    for _ in range(50):
        action = policy.act(observation[None], start)[0]
        observation, _, _, _, info = env.step(action)
        start[:] = False
    successes += info["is_success"]
simulation = env.unwrapped.simulation
result = {
    "successes": successes,
    "homing_error": max(errors),
    "measurement_age": float(simulation.measurement_age[0]),
    "missed": info["frobs/missed_deadlines"],
    "counts": dict(env.unwrapped.robot.rules.counts),
    "stamps": info.get("frobs/lateness"),
}
if "--image" in sys.argv:
    image = simulation.render(None, "overview", (48, 64))
    result["image"] = [list(image.shape), float(image.std())]
simulation.hold()
env.close()
print(json.dumps(result))
