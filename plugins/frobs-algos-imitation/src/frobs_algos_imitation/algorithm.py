"""The base class of all algorithms: settings, files, prediction, export, and updates of the network."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch as th

from frobs_algos import demonstrations, storage
from frobs_algos.algorithm import PolicyAlgorithm
from frobs_algos.spaces import is_picture, subspaces
from frobs_algos_imitation.networks import Perceptron
from frobs_algos_imitation.pictures import augmented, check_pictures
from frobs_algos_imitation.policy import ImitationPolicy
from frobs_algos_imitation.samples import Samples
from frobs_core.contracts import TrainingMonitor
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError, NonFiniteValueError


class ImitationAlgorithm(PolicyAlgorithm):
    """Base class of algorithms that fit a network to actions.

    Attributes:
        policy: The policy.
        steps: Number of training steps so far.
        samples: Samples collected so far, or None.
    """

    policy: ImitationPolicy
    steps: int
    samples: Samples | None

    def _build(
        self, env: gym.vector.VectorEnv[Any, Any, Any], config: Any, seed: int, scale: list[float] | None
    ) -> None:
        super()._build(env, config, seed, scale)
        self._check_spaces(self.observation_space, self.action_space)
        self.steps, self.samples = 0, None
        th.set_num_threads(config.torch_threads)
        self._generator = th.Generator().manual_seed(seed)
        with th.random.fork_rng(devices=[]):
            th.manual_seed(seed)
            self.policy = self._make_policy()
        self._begin_fit()

    def _make_policy(self) -> ImitationPolicy:
        space: Any = self.action_space
        return ImitationPolicy(self.observation_space, space, self._make_network, self._config.history)

    def _make_network(self, frame: int, action: int, points: int) -> th.nn.Module:
        return Perceptron(self._config.history, frame, action, points, self._config.net_arch)

    def _check_spaces(self, observation: gym.Space[Any], action: gym.Space[Any]) -> None:
        owner = f"algorithm '{self.name}'"
        parts = subspaces(observation)
        pictures = {name: part for name, part in parts.items() if is_picture(part)}
        if not all(
            isinstance(part, gym.spaces.Box) and (len(part.shape) == 1 or name in pictures)
            for name, part in parts.items()
        ):
            raise IncompatibleSpaceError(
                owner, observation, f"learns from vectors and color pictures, but the observation space is {observation}; "
                "leave out other parts."
            )  # fmt: skip
        check_pictures(owner, pictures)
        if not isinstance(action, gym.spaces.Box) or not action.is_bounded():
            raise IncompatibleSpaceError(
                owner, action, f"requires actions with finite bounds, but the action space is {action}; choose another "
                "controller."
            )  # fmt: skip

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the next state. The policy is always deterministic."""
        parts = [observation[key] for key in self.policy.spaces] if isinstance(observation, dict) else [observation]
        inputs, n = [th.as_tensor(np.ascontiguousarray(part)) for part in parts], len(parts[0])
        if shapes := self.policy.state_shapes:
            given = [np.zeros((n, *shape), np.float32) for shape in shapes] if state is None else state
            inputs += [th.as_tensor(part) for part in given]
            start = np.full(n, state is None) if episode_start is None else episode_start
            inputs.append(th.as_tensor(np.ascontiguousarray(start, np.bool_)))
        with th.no_grad():
            action, *following = (part.numpy() for part in self.policy(*inputs))
        return action.astype(self.action_space.dtype, copy=False), tuple(following) or None

    def remembered(
        self, state: tuple[np.ndarray[Any, Any], ...] | None, action: Action
    ) -> tuple[np.ndarray[Any, Any], ...] | None:
        """Return the state with another previous action."""
        if state is None or self._config.history == 1:
            return state
        return (state[0], np.asarray(action, np.float32).reshape(len(action), -1), *state[2:])

    def _samples_of(self, source: str, episodes: int, mapping: str | None = None) -> Samples:
        """Return the samples of a data set, or of the episodes that a policy plays.

        Raises:
            ConfigurationError: A person acted in no step of the data set.
        """
        shown = demonstrations.load(source, self._require_env(), episodes, self._seed, mapping, following=False)
        th.set_num_threads(self._config.torch_threads)  # opening a trained policy may change it
        if not shown.intervention.any():
            raise ConfigurationError(f"{source} contains no step in which a person acted; record some with --takeover.")
        frames, pictures = self.policy.split(shown.observation)
        action = shown.action if self._config.history > 1 else None
        return Samples.of(frames, action, shown.action, shown.episode_start, shown.intervention, pictures)

    def _train_by_updates(self, steps: int, monitor: TrainingMonitor) -> None:
        """Fit the network to the samples until the total number of updates, which are steps, reaches ``steps``."""
        self._require_env()
        total, count = 0.0, 0
        while self.steps < steps:
            total, count = total + self._update(self.steps / steps), count + 1
            self.steps += 1
            if not monitor.is_due(self.steps) and self.steps < steps:
                continue
            go_on = monitor.on_progress(self.steps, {f"{self.name}/loss": total / count})
            total, count = 0.0, 0
            monitor.offer_checkpoint(self.steps, self.save)
            if not go_on:
                return

    @property
    def _network(self) -> ImitationPolicy:
        return self.policy

    def _policy_graph(self) -> ImitationPolicy:
        return self.policy

    def _progress(self) -> dict[str, Any]:
        return {"steps": self.steps}

    @property
    @abstractmethod
    def _chunk(self) -> int:
        """Number of actions that the network predicts."""

    def _begin_fit(self) -> None:
        """Start with a new optimizer."""
        self._optimizer = th.optim.AdamW(
            self.policy.parameters(), self._config.learning_rate, weight_decay=self._config.weight_decay, fused=True
        )

    def _update(self, progress: float) -> float:
        """Update the network once, and return the loss. ``progress`` is the share of updates done, in [0, 1)."""
        assert self.samples is not None
        config, samples = self._config, self.samples
        indices = samples.rows[th.randint(len(samples.rows), (config.batch_size,), generator=self._generator)]
        windows, labels, valid = samples.batch(indices, config.history, self._chunk)
        for group in self._optimizer.param_groups:
            group["lr"] = 0.5 * config.learning_rate * (1.0 + math.cos(math.pi * progress))
        pictures = [
            augmented(each, config.image_shift, config.image_color, self._generator)
            for each in samples.pictures(indices)
        ]
        error = (self.policy.predictions(windows, pictures) - self.policy.scaled(labels)).abs().mean(-1)
        loss = (error * valid).sum() / valid.sum()
        self._optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self._optimizer.step()
        value = float(loss.detach())
        if not math.isfinite(value):
            raise NonFiniteValueError(
                f"algorithm '{self.name}'", "has a loss that is not finite", "train again with a lower learning_rate"
            )
        return value

    def save(self, folder: Path, previous: Path | None = None) -> None:
        """Save the policy, the samples, the optimizer and the random state."""
        super().save(folder, previous)
        storage.write_tensors(
            folder / "training.pt",
            {"optimizer": self._optimizer.state_dict(), "generator": self._generator.get_state()},
        )
        if self.samples is not None:
            self.samples.write(folder / "samples", None if previous is None else previous / "samples")

    def _restore(self, folder: Path, saved: Mapping[str, Any], continuing: bool) -> None:
        super()._restore(folder, saved, continuing)
        self.steps = int(saved["steps"])
        if not continuing:
            return
        path = folder / "training.pt"
        with storage.matching(path):
            training = storage.read_tensors(path)
            self._optimizer.load_state_dict(training["optimizer"])
            self._generator.set_state(training["generator"])
        if (folder / "samples").is_dir():
            self.samples = Samples.read(folder / "samples")
