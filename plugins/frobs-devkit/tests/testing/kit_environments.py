"""A sound environment of Gymnasium's kind, and the same with one fault each: what the kit must catch."""

from __future__ import annotations

import os
from typing import Any

import gymnasium as gym
import numpy as np

NAMES: list[str] = []


class Point(gym.Env[Any, Any]):
    """A point on a line is pushed towards a goal; the episode ends where it leaves the line."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 25}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **_: Any) -> None:
        self.observation_space = gym.spaces.Box(-3.0, 3.0, (3,), np.float32)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.render_mode = render_mode

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.x, self.goal = self.np_random.uniform(-0.5, 0.5, 2)
        self.v = 0.0
        return self.observe(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.v = 0.8 * self.v + 0.2 * float(np.clip(action[0], -1, 1))
        self.x += 0.4 * self.v
        return self.observe(), self.reward(), bool(abs(self.x) > 1.0), False, self.info()

    def observe(self) -> Any:
        return np.array([np.clip(self.x, -3, 3), self.v, self.goal], np.float32)

    def reward(self) -> float:
        return -abs(self.x - self.goal)

    def info(self) -> dict[str, Any]:
        return {"is_success": float(abs(self.x - self.goal) < 0.1)}

    def render(self) -> Any:
        picture = np.zeros((16, 32, 3), np.uint8)
        picture[:, int(np.clip(8 * self.x + 16, 0, 31))] = 255
        return picture


class GoalPoint(Point):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        goal = gym.spaces.Box(-3.0, 3.0, (1,), np.float32)
        self.observation_space = gym.spaces.Dict(
            {"observation": gym.spaces.Box(-3.0, 3.0, (2,), np.float32), "achieved_goal": goal, "desired_goal": goal}
        )

    def observe(self) -> Any:
        x, v, goal = super().observe()
        return {k: np.array(a, np.float32) for k, a in
                {"observation": [x, v], "achieved_goal": [x], "desired_goal": [goal]}.items()}  # fmt: skip

    def reward(self) -> float:
        return float(self.compute_reward(np.float32([self.x]), np.float32([self.goal]), {}))

    def compute_reward(self, achieved: Any, desired: Any, info: Any) -> Any:
        return -np.abs(achieved - desired).sum(-1)


class Float64Observation(Point):
    def observe(self) -> Any:
        return super().observe().astype(np.float64)


class LargeActions(Point):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.action_space = gym.spaces.Box(-2.0, 2.0, (1,), np.float32)


class Warns(Point):
    def seed(self, seed: int | None = None) -> None:
        """Do nothing; Gymnasium warns of this method."""


class Unbounded(Point):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (3,), np.float32)


class ClosesOnce(Point):
    closed = False

    def close(self) -> None:
        if self.closed:
            raise RuntimeError("closed already")
        self.closed = True


class DependsOnProcess(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.goal += 1e-6 * (os.getpid() % 1000 + 1)
        return self.observe(), {}


class LeavesSpace(Point):
    def observe(self) -> Any:
        return np.array([10 * self.x, self.v, self.goal], np.float32)


class NanInInfo(Point):
    def info(self) -> dict[str, Any]:
        return {**super().info(), "distance": float("nan") if self.x > 0.6 else 0.0}


class SharedMemory(Point):
    def observe(self) -> Any:
        self.buffer = getattr(self, "buffer", np.zeros(3, np.float32))
        self.buffer[:] = super().observe()
        return self.buffer


class ConstantElement(Point):
    def observe(self) -> Any:
        return super().observe() * np.float32([1, 1, 0])


class ConstantGoal(GoalPoint):
    def observe(self) -> Any:
        return {**super().observe(), "desired_goal": np.float32([0.25 + 0.001 * (self.v != 0)])}


class GoalOnFloor(GoalPoint):
    """Its goals have a second element that is always the same; that of the achieved goal varies if ``bounces``."""

    bounces = True

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        goal = gym.spaces.Box(-3.0, 3.0, (2,), np.float32)
        self.observation_space = gym.spaces.Dict(
            {**self.observation_space.spaces, "achieved_goal": goal, "desired_goal": goal}  # type: ignore[attr-defined]
        )

    def observe(self) -> Any:
        seen = super().observe()
        height = 0.1 * float(seen["observation"][1]) if self.bounces else 0.0
        achieved, desired = np.append(seen["achieved_goal"], height), np.append(seen["desired_goal"], 0.0)
        return {**seen, "achieved_goal": achieved.astype(np.float32), "desired_goal": desired.astype(np.float32)}


class FlatGoal(GoalOnFloor):
    bounces = False


class SeedIgnored(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        return super().reset(seed=None)


class GlobalRandomState(Point):
    def step(self, action: Any) -> Any:
        self.v += 0.01 * np.random.uniform()  # noqa: NPY002 - the fault
        return super().step(action)


class OneStart(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.x, self.goal = 0.1, 0.3
        return self.observe(), {}


class OneEpisode(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        self.first = seed if seed is not None else getattr(self, "first", 0)
        return super().reset(seed=self.first)


class KeepsVelocity(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        before = getattr(self, "v", 0.0)
        super().reset(seed=seed)
        self.v = before
        return self.observe(), {}


class SharedState(Point):
    """What belongs to each environment belongs to all of them."""

    shared: dict[str, float] = {}  # noqa: RUF012 - the fault

    @property
    def v(self) -> float:
        return self.shared["v"]

    @v.setter
    def v(self, value: float) -> None:
        self.shared["v"] = value


class BooleanSuccess(Point):
    def info(self) -> dict[str, Any]:
        return {"is_success": bool(super().info()["is_success"])}


class RareSuccess(Point):
    def info(self) -> dict[str, Any]:
        return super().info() if abs(self.x) < 0.5 else {}


class GoalRewardOff(GoalPoint):
    def reward(self) -> float:
        return super().reward() - 0.01


class GoalNotVectorised(GoalPoint):
    def compute_reward(self, achieved: Any, desired: Any, info: Any) -> Any:
        return -np.abs(achieved - desired).sum()


class GoalWithoutComputeReward(GoalPoint):
    compute_reward = None  # type: ignore[assignment]

    def reward(self) -> float:
        return -abs(self.x - self.goal)


class GoalRewardsDistance(GoalPoint):
    def compute_reward(self, achieved: Any, desired: Any, info: Any) -> Any:
        return np.abs(achieved - desired).sum(-1)


class FloatPicture(Point):
    def render(self) -> Any:
        return super().render() / 255.0


class BlackPicture(Point):
    def render(self) -> Any:
        return 0 * super().render()


class RenderMoves(Point):
    def render(self) -> Any:
        self.v += 1e-3
        return super().render()


class ActionsFromOne(Point):
    """What stable-baselines3 cannot do: a discrete space that does not begin at 0."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.action_space = gym.spaces.Discrete(3, start=1)

    def step(self, action: Any) -> Any:
        return super().step([float(action) - 2.0])


class ClosesOnceWhenNew(Point):
    closed, resets, steps = False, 0, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        self.resets += 1
        return super().reset(seed=seed)

    def step(self, action: Any) -> Any:
        self.steps += 1
        return super().step(action)

    def close(self) -> None:
        if self.closed and self.resets == 1 and not self.steps:
            raise RuntimeError("closed already")
        self.closed = True


class WritesToTheLast(Point):
    """Writes to an observation that it returned two steps before."""

    def step(self, action: Any) -> Any:
        observation, *rest = super().step(action)
        self.kept = [*getattr(self, "kept", [])[-1:], observation]
        self.kept[0][1] = self.v
        return observation, *rest


class TiresLate(Point):
    """The second time that it is seeded, something is different late in the play."""

    seeded, steps = 0, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        if seed is not None:
            self.seeded, self.steps = self.seeded + 1, 0
        return super().reset(seed=seed)

    def step(self, action: Any) -> Any:
        self.steps += 1
        if self.seeded > 1 and self.steps > 45:
            self.v += 1e-4
        return super().step(action)


class FewSeeds(Point):
    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        return super().reset(seed=None if seed is None else seed % 2**31)


class RemembersPushes(Point):
    """Warm from one episode to the next, when it was pushed as hard as can be for long."""

    heat = 0

    def step(self, action: Any) -> Any:
        self.heat = min(self.heat + 1, 40) if np.abs(action).min() >= 1.0 else self.heat
        return super().step(action)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.x += 1e-3 * (self.heat >= 20)
        return self.observe(), {}


class _Batch(gym.vector.SyncVectorEnv):
    """A batch of its own, as a package may bring: here with one fault."""

    def __init__(self, num_envs: int, autoreset_mode: Any, max_episode_steps: int, **_: Any) -> None:
        make = lambda: gym.wrappers.TimeLimit(Point(), max_episode_steps)  # noqa: E731
        super().__init__([make] * num_envs, autoreset_mode=autoreset_mode)


class LastRowOff(_Batch):
    def step(self, actions: Any) -> Any:
        return super().step(actions * np.float32(1 - 1e-6 * (np.arange(len(actions)) == self.num_envs - 1))[:, None])


class SeedsAlike(_Batch):
    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        return super().reset(seed=[seed] * self.num_envs if isinstance(seed, int) else seed, options=options)


class FinalObservationLost(_Batch):
    def step(self, actions: Any) -> Any:
        observation, reward, terminated, truncated, info = super().step(actions)
        for i in np.flatnonzero(info.get("_final_obs", [])):
            info["final_obs"][i] = observation[i].copy()
        return observation, reward, terminated, truncated, info


class TruncationLate(_Batch):
    def __init__(self, num_envs: int, autoreset_mode: Any, max_episode_steps: int, **_: Any) -> None:
        super().__init__(num_envs, autoreset_mode, max_episode_steps + 1)


class ResetsAll(_Batch):
    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        return super().reset(seed=seed)


class ResetStepCounts(_Batch):
    def step(self, actions: Any) -> Any:
        resetting = self._autoreset_envs.copy()
        observation, reward, terminated, truncated, info = super().step(actions)
        return observation, np.where(resetting, -0.5, reward), terminated, truncated, info


class ResetStepCountsInNextStep(ResetStepCounts):
    def step(self, actions: Any) -> Any:
        if self.metadata["autoreset_mode"] is gym.vector.AutoresetMode.NEXT_STEP:
            return super().step(actions)
        return _Batch.step(self, actions)


class EndsAreNumbers(_Batch):
    def step(self, actions: Any) -> Any:
        observation, reward, terminated, *rest = super().step(actions)
        return observation, reward, terminated.astype(np.uint8), *rest


class SharedBatchMemory(_Batch):
    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self.copy = False


def _register(cls: type, batch: type | None = None) -> None:
    name = (batch or cls).__name__
    NAMES.append(name)
    gym.register(f"kit/{name}-v0", cls, max_episode_steps=30, vector_entry_point=batch)


for _name, _thing in list(globals().items()):
    if not isinstance(_thing, type) or _name.startswith("_"):
        continue
    if issubclass(_thing, Point):
        _register(_thing)
    elif issubclass(_thing, _Batch):
        _register(Point, _thing)

gym.register("kit/Unpicklable-v0", Point, max_episode_steps=30, kwargs={"function": lambda: 0})
