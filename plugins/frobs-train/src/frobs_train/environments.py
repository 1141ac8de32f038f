"""Create environments of FRobs and of other packages by Gymnasium ID."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium as gym
from gymnasium.vector import AutoresetMode

from frobs_cli.model_options import ROBOT_FLAGS
from frobs_core import plugins
from frobs_core.kernel.compose import check_num_envs, plan
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.fitting import fixed_keywords
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.plugins.registry import bare_id, find_spec
from frobs_core.util.errors import FrobsError, ParameterValueError
from frobs_core.util.plain import plain
from frobs_train.configuration.components import build_component, load_wrapper
from frobs_train.configuration.config import ComponentConfig
from frobs_train.environment_checks import CheckedEnv
from frobs_train.errors import ComponentError, EnvironmentBuildError

_OF_GYMNASIUM = ("max_episode_steps", "disable_env_checker")
"""Keywords that ``gymnasium.make`` does not pass on to an environment."""


@dataclass(frozen=True)
class EnvironmentRecipe:
    """Recipe for a training run's environments, from which other processes can make additional environments.

    Attributes:
        environment: Gymnasium ID.
        kwargs: Keywords of the environment.
        wrappers: Wrappers of the run's configuration.
        obstacle: Reason why other processes cannot make equivalent environments, or an empty string.
    """

    environment: str
    kwargs: Mapping[str, Any]
    wrappers: tuple[ComponentConfig, ...] = ()
    obstacle: str = ""

    def make(self, num_envs: int, num_threads: int) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Make ``num_envs`` unseeded environments.

        FRobs environments use ``num_threads`` threads, but at most one thread per environment.
        """
        kwargs = dict(self.kwargs)
        if "num_threads" in kwargs:
            kwargs["num_threads"] = min(num_threads, num_envs)
        return make_vector_env(self.environment, num_envs, kwargs, self.wrappers)


def make_vector_env(
    environment: str,
    num_envs: int | Mapping[str, int],
    kwargs: Mapping[str, Any],
    wrappers: Sequence[ComponentConfig] = (),
) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make a vector environment with same-step autoreset.

    If the ID has a native vector environment with same-step autoreset, this environment is used. Otherwise, single
    environments are stepped one by one. A paced simulator supports only one environment. Wrappers for single
    environments are applied to each environment, so the native vector environment cannot be used with them. Wrappers
    for vector environments are applied to the vector environment.

    Args:
        environment: Gymnasium ID.
        num_envs: Number of environments ≥ 1, or the number on each simulator by its name, which only environments of
            FRobs support, without wrappers for single environments.
        kwargs: Keywords of the environment.
        wrappers: Wrappers, innermost first.

    Raises:
        ParameterValueError: ``num_envs`` is not such a number or mapping.
        ComponentError: A wrapper is for single environments, but ``num_envs`` names simulators.
        EnvironmentBuildError: The environment raised an exception.
    """
    if not isinstance(num_envs, Mapping):
        check_num_envs(num_envs)
    spec = find_spec(environment)
    loaded = [(load_wrapper(component), component) for component in wrappers]
    single = [item for item in loaded if issubclass(item[0], gym.Wrapper)]
    with _build_errors(environment, kwargs):
        if isinstance(num_envs, Mapping):
            env = _make_mixed(spec, num_envs, kwargs, single)
        else:
            env = _make_vec(spec, num_envs, kwargs, single)
    try:
        for cls, component in loaded:
            if issubclass(cls, gym.vector.VectorWrapper):
                env = build_component(cls, [env], component, "wrapper")
    except BaseException:
        env.close()
        raise
    return env


def _make_mixed(
    spec: gym.envs.registration.EnvSpec,
    num_envs: Mapping[str, int],
    kwargs: Mapping[str, Any],
    wrappers: Sequence[tuple[type[Any], ComponentConfig]],
) -> gym.vector.VectorEnv[Any, Any, Any]:
    if _keywords(spec.id, kwargs) is None or spec.additional_wrappers:
        raise ParameterValueError(
            "num_envs", dict(num_envs), f"a number, because '{spec.id}' is not an environment of FRobs"
        )
    for _, component in wrappers:
        raise ComponentError(
            "wrapper",
            component.name,
            "wraps a single environment, which several simulators do not support; rewrite it as a "
            "gymnasium.vector.VectorWrapper.",
        )
    return gym.make_vec(spec, num_envs, vectorization_mode="vector_entry_point", **kwargs)  # type: ignore[arg-type]


def _make_vec(
    spec: gym.envs.registration.EnvSpec,
    num_envs: int,
    kwargs: Mapping[str, Any],
    wrappers: Sequence[tuple[type[Any], ComponentConfig]],
) -> gym.vector.VectorEnv[Any, Any, Any]:
    if num_envs > 1 and is_paced({**spec.kwargs, **kwargs}.get("simulator")):
        raise ParameterValueError("num_envs", num_envs, "1 on a simulator that is paced")
    if spec.vector_entry_point is not None and not spec.additional_wrappers and not wrappers:
        env = gym.make_vec(spec, num_envs, vectorization_mode="vector_entry_point", **kwargs)
        if env.metadata.get("autoreset_mode") == AutoresetMode.SAME_STEP:
            return env
        env.close()  # the environment uses next-step autoreset, which is Gymnasium's default
    return gym.make_vec(
        spec,
        num_envs,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP},
        wrappers=[
            *(partial(_wrap, cls, component) for cls, component in wrappers),
            partial(CheckedEnv, environment=spec.id, warned=set()),
        ],
        disable_env_checker=True,  # CheckedEnv reports the same problems as errors that contain the fix
        **kwargs,
    )


def check_environment(environment: str, kwargs: Mapping[str, Any]) -> None:
    """Check the keywords of a FRobs environment without importing an engine. Other environments are not checked."""
    keywords = _keywords(environment, kwargs)
    if keywords is not None:
        with _build_errors(environment, kwargs):
            plan(EnvConfig.from_dict(keywords), 1)


def with_fixed_keywords(environment: str, kwargs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of an environment, with those that state what its robot's file contains and what fits it.

    The keywords of environments of other packages, and of environments with their own robot, are not changed.
    """
    keywords = _keywords(environment, kwargs)
    if keywords is None or not kwargs.keys() & {*ROBOT_FLAGS, "fit"}:
        return dict(kwargs)
    with _build_errors(environment, kwargs):
        return {**kwargs, **plain(fixed_keywords(keywords), for_yaml=True)}


def _keywords(environment: str, kwargs: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the keywords of a FRobs environment, including those of its ID, or None for other environments."""
    spec = gym.registry.get(bare_id(environment))
    if spec is None or spec.entry_point not in ("frobs_core.kernel.env:RobotEnv", RobotEnv):
        return None
    return {key: value for key, value in {**spec.kwargs, **kwargs}.items() if key not in _OF_GYMNASIUM}


def is_paced(simulator: str | SimulatorRecord | None) -> bool:
    """Return whether a simulator, given by name or record, is paced. Return False for unknown simulators."""
    record = plugins.records("simulator").get(simulator) if isinstance(simulator, str) else simulator
    return isinstance(record, SimulatorRecord) and record.is_paced


@contextmanager
def _build_errors(environment: str, kwargs: Mapping[str, Any]) -> Iterator[None]:
    """Convert exceptions of other packages to EnvironmentBuildError."""
    try:
        yield
    except FrobsError:
        raise
    except Exception as error:
        raise EnvironmentBuildError(environment, kwargs, error) from error


def _wrap(cls: type[Any], component: ComponentConfig, env: gym.Env[Any, Any]) -> Any:
    return build_component(cls, [env], component, "wrapper")


def make_env(
    environment: str,
    kwargs: Mapping[str, Any],
    render_mode: str | None = None,
    wrappers: Sequence[ComponentConfig] = (),
) -> gym.Env[Any, Any]:
    """Make one environment and apply the wrappers for single environments.

    Args:
        environment: Gymnasium ID.
        kwargs: Keywords of the environment.
        render_mode: Render mode of the environment, or None to render nothing.
        wrappers: Wrappers, innermost first.

    Raises:
        ComponentError: A wrapper is for vector environments.
    """
    spec = find_spec(environment)
    loaded = [(load_wrapper(component), component) for component in wrappers]
    for cls, component in loaded:
        if not issubclass(cls, gym.Wrapper):
            raise ComponentError(
                "wrapper",
                component.name,
                "wraps a vector environment, but a window or video shows a single environment; "
                "evaluate the run instead, or rewrite the wrapper as a gymnasium.Wrapper.",
            )
    with _build_errors(environment, kwargs):
        env = gym.make(spec, render_mode=render_mode, disable_env_checker=True, **kwargs)
    for cls, component in loaded:
        env = _wrap(cls, component, env)
    return CheckedEnv(env, environment)
