"""Records episodes in which a person acts, alone or instead of a policy: start, keep, discard, and a steady rate."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.contracts import Operator, Pacer, Policy
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_data.recorded_features import INTERVENTION
from frobs_train.training.interrupts import Interrupts

if TYPE_CHECKING:
    from frobs_data.recording import Recorder

START, KEEP, DISCARD, TAKE_OVER = "start", "keep", "discard", "take over"

_IDLE = 0.02
"""Time between two looks for a command [s]."""

_log = logging.getLogger("frobs")


class Takeover(Policy):
    """Policy in whose place a person acts while the person moves the robot, or until the person hands back.

    Args:
        policy: The policy, which is bound.
        operator: The person, who is bound to the same environment.

    Attributes:
        is_taken: Whether the person has taken over until further notice.
    """

    def __init__(self, policy: Policy, operator: Operator) -> None:
        self._policy, self._operator = policy, operator
        self.is_taken = self._intervenes = False

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        """Return the action of the person or of the policy, whose memory contains what was really done."""
        if episode_start.any():
            self.is_taken = False
        action = self._policy.act(observation, episode_start)
        self._intervenes = self.is_taken or self._operator.is_moving
        # Without an intervention, the person starts afresh at each step, so that nothing jumps at the takeover.
        person = self._operator.act(observation, episode_start | (not self._intervenes))
        if not self._intervenes:
            return action
        self._policy.remember(person)
        return person

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return the facts of the policy, and whether the person acted."""
        return {**self._policy.info(), INTERVENTION: np.array([self._intervenes])}


def play_operated(
    env: Any,
    policy: Policy,
    operator: Operator,
    recorder: Recorder,
    interrupts: Interrupts,
    on_progress: Callable[[int, int], object] | None = None,
    pacer: Pacer | None = None,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Play episodes that a person starts, and keeps or discards, until there are enough of them or a signal arrives.

    Args:
        env: Vector environment with one environment and same-step autoreset.
        policy: What acts: the operator, or a :class:`Takeover`.
        operator: The person.
        recorder: What stores the steps.
        interrupts: The signals.
        on_progress: Called after each step with the numbers of recorded and of finished episodes.
        pacer: Clock that keeps the control rate, unless the simulator is paced.
        sleep: Function that waits while nothing happens.
    """
    pacer, total = pacer or Pacer(), int(recorder.left.sum())
    is_paced = recorder.env.simulation.pacer is not None
    recording = (KEEP, DISCARD, *((TAKE_OVER,) if isinstance(policy, Takeover) else ()))

    def show(text: str) -> None:
        operator.show(f"episode {recorder.attempts + 1:,} of {total:,}, kept {recorder.kept:,}: {text}")

    def wait_for(*commands: str) -> str:
        operator.offer(commands)
        while interrupts.requested is None:
            if (command := operator.command()) in commands:
                return command
            if not command:
                sleep(_IDLE)
        return ""

    start, news = np.ones(1, np.bool_), ""
    observation, _ = env.reset(seed=recorder.seed)
    while recorder.left.any():
        recorder.begin(start)
        show(f"{news}press start")
        if not wait_for(START):
            return
        show("recording")
        operator.offer(recording)
        pacer.restart()
        decision, steps, late, done = "", 0, 0, np.zeros(1, np.bool_)
        while not decision and not done.any():
            action = recorder.stored_action(policy.act(observation, start if steps == 0 else ~start))
            recorder.before_step(observation, action, policy.info())
            observation, reward, terminated, truncated, info = env.step(action)
            done = terminated | truncated
            recorder.store(reward, done, terminated, info["is_success"])
            steps += 1
            if on_progress is not None:
                on_progress(recorder.kept, recorder.attempts)
            if not is_paced:
                pacer.wait(recorder.env.control_timestep)
            late = int(info["frobs/missed_deadlines"][0]) if is_paced else pacer.missed
            while not decision and (command := operator.command()):
                decision = command if command in (KEEP, DISCARD) else ""
                if command == TAKE_OVER and isinstance(policy, Takeover):
                    policy.is_taken = not policy.is_taken
            if interrupts.requested is not None:
                return
        missed = f"{late:,} of {steps:,} deadlines missed"
        if late:
            _log.warning(
                "episode %d: %s; the robot moved more slowly than in real time.", recorder.attempts + 1, missed
            )
        if not decision:
            show(f"the episode has ended, {missed}; keep or discard it")
            decision = wait_for(KEEP, DISCARD)
        if not decision:
            return
        before = recorder.kept
        if not done.any():  # otherwise, the environment has drawn the next seed already
            recorder.seed_again(start)
        recorder.finish(start, keep=decision == KEEP)
        result = "kept" if recorder.kept > before else "discarded"
        news = f"the last episode was {result}, {missed}; "
        if not done.any():
            observation, _ = env.reset()
    operator.offer(())
    show("all episodes are recorded")
