"""DAgger."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import torch as th

from frobs_algos.demonstrations import clipped
from frobs_algos.spaces import picture_bytes
from frobs_algos_imitation.algorithm import ImitationAlgorithm
from frobs_algos_imitation.config import DaggerConfig, ImitationConfig
from frobs_algos_imitation.samples import Samples
from frobs_core import load_policy
from frobs_core.contracts import Policy, TrainingMonitor
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.memory import require_memory


class Dagger(ImitationAlgorithm):
    """Dataset aggregation (Ross et al. 2011).

    In the first round, the expert acts in one episode of each environment. In all later rounds, the learner acts, and
    the expert labels the states that the learner visits. With ``expert_share``, the expert also acts in some steps of
    these rounds, so that the samples include states that follow those in which the learner would get stuck.

    A person cannot label states without acting. If the expert is given as data sets, the learner therefore imitates the
    steps in which the person acted, of the demonstrations and of all corrections together (HG-DAgger, Kelly et al.
    2019). The rounds are separate training runs, each after a recording in which the person corrects the last policy.
    """

    name: ClassVar[str] = "dagger"
    config_model: ClassVar[type[ImitationConfig]] = DaggerConfig

    _config: DaggerConfig

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        expert = self._config.expert
        if isinstance(expert, str):
            load_policy(expert, env).close()  # so that a wrong name leaves no run folder behind
            return
        for source in expert:
            if not (Path(source) / "meta" / "info.json").is_file():
                raise ConfigurationError(f"algorithm 'dagger': expert: {source} is not the folder of a data set.")
        parts = [self._samples_of(str(Path(source).absolute()), 1) for source in expert]  # a name alone is a policy's
        self.samples = Samples([part for samples in parts for part in samples.parts])
        self.policy.normalize(self.samples.frames)

    @property
    def _chunk(self) -> int:
        return 1

    def check_steps(self, steps: int) -> None:
        if isinstance(self._config.expert, str):
            size, left = picture_bytes(self.observation_space), steps - self.steps
            require_memory("algorithm 'dagger'", size, left, "steps", "train for at most {count} steps")

    def train(self, steps: int, monitor: TrainingMonitor) -> None:
        """Train until the total number of environment steps reaches ``steps``. The last round is completed.

        If the expert is given as data sets, the steps are updates of the network.
        """
        if not isinstance(self._config.expert, str):
            self._train_by_updates(steps, monitor)
            return
        with closing(load_policy(self._config.expert, self._require_env())) as expert:
            while self.steps < steps:
                first = self.samples is None
                share = 1.0 if first else self._config.expert_share * max(0.0, 1.0 - self.steps / steps)
                collected, taken = self._play(expert, share, steps)
                self.samples = collected if self.samples is None else self.samples + collected
                self.steps += taken
                if first:
                    self.policy.normalize(self.samples.frames)
                updates = self._config.updates if self.steps < steps else self._config.final_updates
                loss = self._fit(updates)
                if not monitor.is_due(self.steps) and self.steps < steps:
                    continue
                go_on = monitor.on_progress(self.steps, {"dagger/loss": loss, "dagger/samples": len(self.samples)})
                monitor.offer_checkpoint(self.steps, self.save)
                if not go_on:
                    return

    def _fit(self, updates: int) -> float:
        """Fit the network to all samples, and return the mean loss of the last tenth of the updates."""
        self._begin_fit()
        losses = [self._update(index / updates) for index in range(updates)]
        return float(np.mean(losses[-max(1, updates // 10) :]))

    def _play(self, expert: Policy, share: float, most: int) -> tuple[Samples, int]:
        """Play at least one episode in every environment; return the labeled samples and the number of steps.

        The expert acts in a ``share`` of the steps, which are chosen at random. After ``most`` steps, episodes that
        have not ended are cut off.
        """
        env, space = self._require_env(), self.action_space
        seen, _ = env.reset()
        start, ended = np.ones(env.num_envs, np.bool_), np.zeros(env.num_envs, np.bool_)
        state: tuple[np.ndarray[Any, Any], ...] | None = None
        steps: list[tuple[Any, ...]] = []
        while not ended.all() and len(steps) * env.num_envs < most:
            label = clipped(expert.act(seen, start), space)
            action = label
            if share < 1.0:
                action, state = self.predict(seen, state, start)
            if 0.0 < share < 1.0:
                shown = th.rand(env.num_envs, generator=self._generator).numpy() < share
                action = np.where(shown.reshape(-1, *[1] * (label.ndim - 1)), label, action)
                state = self.remembered(state, action)
            frame, views = self.policy.split(seen)
            steps.append((frame, action.copy(), label.copy(), start, *(each.copy() for each in views.values())))
            seen, _, terminated, truncated, _ = env.step(action)
            start = terminated | truncated
            ended |= start
        # One environment after another, so that the frames of an episode follow each other.
        frames, action, label, start, *by_camera = (
            np.stack(part, axis=1).reshape(-1, *np.shape(part[0])[1:]) for part in zip(*steps, strict=True)
        )
        executed = action if self._config.history > 1 else None
        pictures = dict(zip(self.policy.cameras, by_camera, strict=True))
        return Samples.of(frames, executed, label, start, pictures=pictures), len(steps) * env.num_envs
