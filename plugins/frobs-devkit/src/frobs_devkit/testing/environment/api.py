"""Checks of an environment's public API: third-party checkers, spec, keywords, other processes and rendering."""

from __future__ import annotations

import importlib
import importlib.util
import pickle
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env as gymnasium_check_env

from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.util.errors import CapabilityError, RenderingUnavailableError, UnknownParameterError
from frobs_devkit.testing.checks import (
    CheckFailure,
    Inconclusive,
    NotApplicable,
    after,
    expect,
    expect_raises,
    second_close,
)
from frobs_devkit.testing.compare import expect_array, expect_same
from frobs_devkit.testing.environment.rollout import draw_actions, expect_same_play, play
from frobs_devkit.testing.environment.under_test import EnvUnderTest, is_ours

_COLOUR = re.compile(r"\x1b\[\d+m")  # Gymnasium's logger colors its warnings
_UNBOUNDED = re.compile("A Box observation space (minimum|maximum) value is -?infinity")  # such as accelerations

_CHILD = """
import pickle, sys
from copy import deepcopy
import gymnasium
id, kwargs, actions = pickle.load(sys.stdin.buffer)
env = gymnasium.make(id, **kwargs)
observations = [deepcopy(env.reset(seed=11)[0]), *(deepcopy(env.step(action)[0]) for action in actions)]
env.close()
sys.stdout.buffer.write(b"observations:" + pickle.dumps(observations))
"""


@after("spaces_hold")
def gymnasium_checker(subject: EnvUnderTest) -> None:
    """Gymnasium's environment checker reports no errors and no warnings, except that an observation has no bounds."""
    subject.require_pause()
    with closing(subject.make()) as env:
        _without_a_warning(lambda: gymnasium_check_env(env.unwrapped, skip_render_check=True))


@after("spaces_hold")
def stable_baselines3_checker(subject: EnvUnderTest) -> None:
    """The environment checker of Stable-Baselines3 reports no errors and no warnings."""
    subject.require_pause()
    if importlib.util.find_spec("stable_baselines3") is None:
        raise Inconclusive("stable-baselines3 is not installed: pip install stable-baselines3")
    check = importlib.import_module("stable_baselines3.common.env_checker").check_env
    with closing(subject.make()) as env:
        _without_a_warning(lambda: check(env.unwrapped, warn=True, skip_render_check=True))


@after("same_seed_repeats")
def spec_pickles(subject: EnvUnderTest) -> None:
    """An environment's spec can be pickled, and the unpickled spec creates the same environment."""
    subject.require_pause()
    with closing(subject.make()) as env:
        actions = draw_actions(env.action_space, 5, seed=3)
        expected = play(env, 3, actions)
        again = pickle.loads(pickle.dumps(env.spec))
    with closing(gym.make(again)) as env:
        expect_same_play(expected, play(env, 3, actions), "the environment from the pickled spec")


def close_twice(subject: EnvUnderTest) -> None:
    """Closing an environment a second time has no effect, both before and after a reset."""
    for resets in (0, 1):
        env = subject.make()
        if resets:
            env.reset(seed=0)
        env.close()
        with second_close():
            env.close()


def unknown_keyword_refused(subject: EnvUnderTest) -> None:
    """An unknown keyword argument raises an error that contains the argument's name."""
    with subject.ours(), expect_raises(UnknownParameterError, "make(no_such_parameter=1)", naming="no_such_parameter"):
        subject.make(no_such_parameter=1).close()


@after("same_seed_repeats")
def fresh_process(subject: EnvUnderTest) -> None:
    """A process that imports only Gymnasium can create the environment and receives the same observations."""
    subject.require_pause()
    with closing(subject.make()) as env:
        actions = draw_actions(env.action_space, 5, seed=11)
        first, transitions = play(env, 11, actions)
    if any(transition.done for transition in transitions):
        actions = []
    expected = [first, *(transition.observation for transition in transitions[: len(actions)])]
    job = pickle.dumps((subject.self_importing_id, dict(subject.kwargs), actions))
    child = subprocess.run([sys.executable, "-c", _CHILD], input=job, capture_output=True, timeout=120, check=False)
    if child.returncode:
        text = child.stderr.decode(errors="replace").strip().splitlines()
        raise CheckFailure(
            f"gymnasium.make('{subject.self_importing_id}') fails in a fresh process: "
            f"{text[-1] if text else 'no output'}"
        )
    _, _, data = child.stdout.partition(b"observations:")
    for k, (a, b) in enumerate(zip(expected, pickle.loads(data), strict=True)):
        expect_same(a, b, f"the observation at step {k} in a fresh process")


def _without_a_warning(call: Callable[[], Any]) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", FrobsDeprecationWarning)  # nothing_deprecated_is_used judges these
        try:
            call()
        except Exception as error:
            raise CheckFailure(f"{type(error).__name__}: {error}") from error
    texts = [_COLOUR.sub("", str(warning.message)) for warning in caught]
    texts = [text for text in texts if not _UNBOUNDED.search(text)]
    if texts:
        raise CheckFailure("; ".join(texts))


_SIZE = (96, 128)


@after("same_seed_repeats")
def render_draws(subject: EnvUnderTest) -> None:
    """``render()`` returns a non-empty image of the configured size and has no side effects."""
    with closing(subject.make()) as env:
        ours = is_ours(env)
        if "rgb_array" not in env.metadata.get("render_modes", ()):
            raise NotApplicable("the environment has no render mode 'rgb_array'")
        actions = draw_actions(env.action_space, 6, seed=14)
        expected = play(env, 14, actions)
    sized: dict[str, Any] = {"render_size": _SIZE} if ours else {}
    try:
        with closing(subject.make(render_mode="rgb_array", **sized)) as env:
            env.reset(seed=0)
            picture: Any = env.render()
            expect_array(picture, (*(_SIZE if ours else np.shape(picture)[:2]), 3), np.uint8, "the result of render()")
            colours = len(np.unique(picture.reshape(-1, 3), axis=0))
            expect(colours > 1, "the image has a single color, so it shows nothing.")
            expect_same_play(expected, play(_Rendering(env), 14, actions), "an environment that renders at every step")
    except (CapabilityError, RenderingUnavailableError, gym.error.DependencyNotInstalled) as error:
        raise Inconclusive(str(error)) from error


class _Rendering(gym.Wrapper[Any, Any, Any, Any]):
    def step(self, action: Any) -> Any:
        result = self.env.step(action)
        self.env.render()
        return result
