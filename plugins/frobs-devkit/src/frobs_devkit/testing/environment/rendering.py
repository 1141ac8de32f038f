"""Checks of rendering."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.errors import CapabilityError, RenderingUnavailableError
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect
from frobs_devkit.testing.compare import expect_array
from frobs_devkit.testing.environment.rollout import draw_actions, expect_same_play, play
from frobs_devkit.testing.environment.under_test import EnvUnderTest, is_ours

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
            picture = env.render()
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
