"""Runs RLlib's algorithm from its construction to the end of training, and reports to the run's monitor."""

from __future__ import annotations

import logging
import math
import time
import warnings
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import ray
import torch as th
from ray.exceptions import RayError
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from ray.rllib.utils.metrics import ENV_RUNNER_RESULTS, LEARNER_RESULTS, NUM_ENV_STEPS_SAMPLED_LIFETIME

from frobs_core.contracts import TrainingMonitor
from frobs_ray.cluster import connect, quiet
from frobs_ray.errors import ClusterSizeError, EnvironmentRunnerError
from frobs_ray.rllib import state
from frobs_ray.rllib.env_runner import EPISODES, VectorEnvRunner, recipe_of

if TYPE_CHECKING:
    from frobs_ray.rllib.algorithm import RLlibAlgorithm

_log = logging.getLogger("frobs")

_PATIENCE = 600.0  # [s] maximum time without a working environment runner
_PAUSE = 0.1  # [s] time between attempts while no environment runner works
_START = 60.0  # [s] maximum time for the runners to create their environments
_PROBE = 1.0  # [s] maximum time to wait for a response from a failed environment runner
_UNINTERESTING = ("num_", "last_target_update", "module_train_batch_size", "weights_seq_no")
_NAMES = {
    "curr_entropy_coeff": "ent_coef",
    "curr_kl_coeff": "kl_coeff",
    "default_optimizer_learning_rate": "learning_rate",
    "gradients_default_optimizer_global_norm": "gradient_norm",
    "mean_kl_loss": "approx_kl",
    "policy_learning_rate": "learning_rate",
    "vf_explained_var": "explained_variance",
    "vf_loss": "value_loss",
}
"""RLlib's metrics, with the name that ``frobs-algos-sb3`` uses for the same metric."""


class Training:
    """Trains an algorithm with RLlib."""

    def __init__(
        self, owner: RLlibAlgorithm, env: gym.vector.VectorEnv[Any, Any, Any], monitor: TrainingMonitor
    ) -> None:
        self._owner, self._env, self._monitor = owner, env, monitor
        self._metrics: dict[str, float] = {}
        self._first = owner.steps
        self._working = -1

    def run(self, steps: int) -> None:
        """Train until ``steps`` environment steps have been taken or the monitor ends training."""
        owner = self._owner
        with ExitStack() as stack:
            stack.enter_context(warnings.catch_warnings())
            warnings.simplefilter("ignore")  # RLlib's own code causes warnings
            # The log entries about failed runners contain tracebacks. This class logs each failure as a single line.
            stack.enter_context(quiet(["ray.rllib.utils.actor_manager"], logging.CRITICAL))
            needed = owner.settings.num_env_runners * owner.settings.cpus_per_env_runner
            stack.enter_context(connect(owner.settings.ray_address, max(needed, 1)))
            available = int(ray.cluster_resources().get("CPU", 0))
            if available < needed:
                raise ClusterSizeError(needed, available)
            seed = np.random.SeedSequence([owner.seed, owner.steps]).generate_state(1)[0] >> 1
            np.random.seed(seed)  # noqa: NPY002  # RLlib shuffles with this generator
            th.manual_seed(int(seed))
            algorithm = self._build(steps)
            stack.callback(algorithm.stop)
            (learner,) = (result.get() for result in algorithm.learner_group.foreach_learner(lambda each: each))
            self._begin(algorithm, learner)
            try:
                self._iterate(algorithm, learner, steps)
            finally:
                owner.learning = state.learning(learner)

    def _build(self, steps: int) -> Any:
        owner, settings = self._owner, self._owner.settings
        runners = settings.num_env_runners
        random_steps = math.ceil(getattr(settings, "learning_starts", 0) / self._env.num_envs)
        config = owner.rllib_config(steps)
        config.framework("torch")
        config.environment(
            env="frobs",
            env_config={
                "recipe": recipe_of(self._env) if runners else None,
                "spaces": owner.spaces,
                "seed": owner.seed + owner.steps,
                "random_steps": 0 if owner.steps else random_steps,
            },
            observation_space=owner.spaces.observation,
            action_space=owner.spaces.action,
            disable_env_checking=True,
        )
        config.env_runners(
            env_runner_cls=VectorEnvRunner,
            num_env_runners=runners,
            num_envs_per_env_runner=self._env.num_envs // max(runners, 1),
            num_cpus_per_env_runner=settings.cpus_per_env_runner,
            sample_timeout_s=_PATIENCE,
            validate_env_runners_after_construction=False,
            add_default_connectors_to_env_to_module_pipeline=False,
            add_default_connectors_to_module_to_env_pipeline=False,
        )
        config.learners(num_learners=0)
        config.rl_module(
            rl_module_spec=RLModuleSpec(
                module_class=owner.module_class,
                observation_space=owner.spaces.observation,
                action_space=owner.spaces.action,
                model_config=owner.model_config(),
            )
        )
        config.fault_tolerance(
            restart_failed_env_runners=True,
            num_consecutive_env_runner_failures_tolerance=1_000_000,
            env_runner_health_probe_timeout_s=_PROBE,
        )
        config.reporting(min_time_s_per_iteration=0, metrics_num_episodes_for_smoothing=1)
        config.debugging(log_level="ERROR")
        VectorEnvRunner.given = None if runners else self._env
        try:
            return config.build_algo(use_copy=False)
        except (IndexError, RayError) as error:  # IndexError: RLlib found no responding runner
            raise EnvironmentRunnerError(f"the runners cannot be started: {type(error).__name__}: {error}") from error
        finally:
            VectorEnvRunner.given = None

    def _begin(self, algorithm: Any, learner: Any) -> None:
        """Copy the networks and optimizer states to RLlib's algorithm, and the networks to all environment runners."""
        _raise_problems(algorithm.env_runner_group, _START)
        module = learner.module[DEFAULT_MODULE_ID].unwrapped()
        module.load_state_dict(self._owner.module.state_dict())
        state.restore_learning(learner, self._owner.learning)
        self._owner.module = module
        algorithm.env_runner_group.sync_weights(
            from_worker_or_learner_group=algorithm.learner_group, inference_only=True
        )

    def _iterate(self, algorithm: Any, learner: Any, steps: int) -> None:
        owner, monitor = self._owner, self._monitor
        last = time.monotonic()
        while owner.steps < steps:
            before = owner.steps
            self._take(algorithm.train())
            self._check_runners(algorithm.env_runner_group)
            if owner.steps == before:
                if time.monotonic() - last > _PATIENCE:
                    raise EnvironmentRunnerError(f"no runner has answered for {_PATIENCE / 60.0:.0f} minutes")
                time.sleep(_PAUSE)
                continue
            last = time.monotonic()
            if owner.steps < steps and monitor.is_due(owner.steps):
                owner.learning = state.learning(learner)
                go_on = self._report()
                monitor.offer_checkpoint(owner.steps, owner.save)
                if not go_on:
                    return
        self._report()

    def _check_runners(self, group: Any) -> None:
        """Log failed environment runners, and raise EnvironmentRunnerError if an environment caused the failure."""
        working = group.num_healthy_remote_workers()
        total = group.num_remote_workers()
        if working < total:
            group.probe_unhealthy_env_runners()  # failed runners that still respond report the cause
            _raise_problems(group, _PROBE)
            if working != self._working:
                message = "%d of %d environment runners work. Ray restarts the failed runners as soon as possible."
                _log.warning(message, working, total)
        elif 0 <= self._working < working:
            _log.warning("All %d environment runners work again.", total)
        self._working = working

    def _take(self, results: dict[str, Any]) -> None:
        """Record the steps, episodes and metrics of an iteration."""
        sampled = results.get(ENV_RUNNER_RESULTS, {})
        self._owner.steps = self._first + int(sampled.get(NUM_ENV_STEPS_SAMPLED_LIFETIME, 0))
        finished = sampled.get(EPISODES, [])
        for item in finished if isinstance(finished, list) else [finished]:  # RLlib unpacks lists with one item
            self._monitor.on_episodes(item.rewards, item.lengths, item.successes, item.terms)
        learned = results.get(LEARNER_RESULTS, {}).get(DEFAULT_MODULE_ID, {})
        for key, value in learned.items():
            known = isinstance(value, int | float | np.number) and not key.startswith(_UNINTERESTING)
            if known and np.isfinite(value):
                self._metrics[f"{self._owner.name}/{_NAMES.get(key, key)}"] = float(value)

    def _report(self) -> bool:
        metrics, self._metrics = self._metrics, {}
        return self._monitor.on_progress(self._owner.steps, metrics)


def _raise_problems(group: Any, timeout: float) -> None:
    """Raise EnvironmentRunnerError if a runner reports a problem before a timeout [s]."""
    problems = group.foreach_env_runner(lambda runner: runner.problem, local_env_runner=False, timeout_seconds=timeout)
    for problem in filter(None, problems):
        raise EnvironmentRunnerError(problem)
