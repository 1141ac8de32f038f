"""Plays policies in a viewed environment, with pause, single steps, speed and a choice of policies."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from frobs_core.contracts import Operator, Policy
from frobs_core.util.errors import FrobsError
from frobs_view.viewer import RATE, BrowserViewer

MakePolicy = Callable[[], Policy]
"""Function that opens a policy in the environment."""


class Player:
    """Runs episodes in an environment that a viewer shows.

    Args:
        env: Single or vector environment with same-step autoreset. It may be wrapped.
        viewer: Viewer that is bound to the environment without its wrappers.
        policies: Functions that open the policies that people can choose, by name. The first is chosen at the start. A
            policy is opened when it is chosen for the first time.
        seed: Seed of the first episode.

    Attributes:
        steps: Number of control steps so far.
        name: Name of the policy that acts.

    Raises:
        FrobsError: The first policy cannot act in the environment.
    """

    def __init__(self, env: Any, viewer: BrowserViewer, policies: Mapping[str, MakePolicy], seed: int = 0) -> None:
        self._env, self._viewer = env, viewer
        self._makers = dict(policies)
        self._opened: dict[str, Policy] = {}
        self._batch = hasattr(env, "num_envs")
        self._count = env.num_envs if self._batch else 1
        self._timestep = float(env.unwrapped.control_timestep)
        self._observation: Any = None
        self._single = False
        self._due = 0.0
        self.steps, self.name = 0, ""
        self.after_step: list[Callable[[], object]] = []
        self._add_panel(viewer.server.gui, seed)
        self.choose(next(iter(self._makers)))

    def _add_panel(self, gui: Any, seed: int) -> None:
        queued = self._viewer.queued
        with gui.add_folder("Play", order=-1.0):
            names = tuple(self._makers)
            self._chooser = gui.add_dropdown("policy", names, initial_value=names[0])
            self._chooser.on_update(queued(lambda: self._try(self._chooser.value)))
            self._play = gui.add_checkbox("play", initial_value=True)
            gui.add_button("single step").on_click(queued(self._step_once))
            self._speed = gui.add_slider("speed", min=0.1, max=4.0, step=0.1, initial_value=1.0)
            self._seed = gui.add_number("seed", initial_value=seed, min=0, max=max(seed, 2**31 - 1), step=1)
            gui.add_button("reset").on_click(queued(lambda: self.reset(int(self._seed.value))))
            self._status = gui.add_text("status", "", disabled=True)

    def choose(self, name: str) -> None:
        """Let the policy ``name`` act from the next step on.

        Raises:
            FrobsError: The policy cannot act in this environment.
        """
        if isinstance(self._opened.get(self.name), Operator):
            self._opened.pop(self.name).close()  # removes the panel from the page
        if name not in self._opened:
            self._opened[name] = self._makers[name]()
        self.name = name
        self._start = np.ones(self._count, bool)
        if self._chooser.value != name:
            self._chooser.value = name

    def replace(self, name: str, policy: Policy) -> None:
        """Use another policy under the name of a policy, for example a newer one of the same run."""
        before = self._opened.get(name)
        self._opened[name] = policy
        if before is not None:
            before.close()
        if name == self.name:
            self._start = np.ones(self._count, bool)

    def _try(self, name: str) -> None:
        before = self.name
        if name == before:
            return
        try:
            self.choose(name)
        except FrobsError:
            self.choose(before)
            raise

    def reset(self, seed: int | None = None) -> None:
        """Begin a new episode. With a seed, all later episodes repeat too."""
        self._observation, _ = self._env.reset(seed=seed)
        self._start = np.ones(self._count, bool)
        self._viewer.update()

    def step(self) -> None:
        """Make one control step with the chosen policy, and begin a new episode when one has ended."""
        observation = self._observation if self._batch else _as_batch(self._observation)
        actions = self._opened[self.name].act(observation, self._start)
        self._observation, _, terminated, truncated, _ = self._env.step(actions if self._batch else actions[0])
        self._start = np.atleast_1d(np.logical_or(terminated, truncated))
        self.steps += 1
        if not self._batch and self._start[0]:
            self._observation, _ = self._env.reset()
        for callback in self.after_step:
            callback()

    def _step_once(self) -> None:
        self._play.value = False
        self._single = True

    def run(self, is_running: Callable[[], bool] = lambda: True) -> None:
        """Play until ``is_running`` returns False, in real time multiplied by the chosen speed.

        While no page is open, nothing is played, so that an unused view takes no processor time from a training run.
        """
        if self._observation is None:
            self.reset(int(self._seed.value))
        self._due, reported = time.monotonic(), 0.0
        while is_running():
            if self._single or (self._play.value and self._viewer.server.has_clients):
                self._single = False
                self.step()
                self._due += self._timestep / float(self._speed.value)
            else:
                self._viewer.update()
                self._due = time.monotonic() + 1.0 / RATE
            now = time.monotonic()
            if now > reported + 0.5:
                reported = now
                self._status.value = f"{self.name}, step {self.steps:,}"
            self._due = max(self._due, now - 0.2)  # after a pause, the lost time is not made up for
            time.sleep(max(0.0, self._due - now))

    def close(self) -> None:
        """Close the policies. The environment and the viewer stay open."""
        for policy in self._opened.values():
            with suppress(FrobsError):
                policy.close()


def _as_batch(observation: Any) -> Any:
    if isinstance(observation, dict):
        return {name: np.asarray(each)[None] for name, each in observation.items()}
    return np.asarray(observation)[None]
