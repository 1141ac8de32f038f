"""Measures alternative settings, and suggests settings that would make a training run faster."""

from __future__ import annotations

import sys
from contextlib import closing
from statistics import median
from time import perf_counter
from typing import Any

from frobs_cli.formats import duration
from frobs_core.util.errors import FrobsError
from frobs_devkit.timing import choose_num_envs
from frobs_devkit.training_window import SIMULATION, UPDATES, MeasuredTraining, measure_training
from frobs_train import RunConfig, decide_threads, make_training_env

_SIZES = tuple(2**k for k in range(3, 11))  # values of ``num_envs`` to try
_WORTHWHILE = 1.1  # minimum speedup for which a change is suggested
_TRY_SECONDS = 0.1  # time to step the environments for each tested number of environments or threads [s]
_SIZES_SECONDS = 2.0
"""Time limit for creating and testing environments of all sizes [s], after which the remaining sizes are skipped."""

_UPDATES_SECONDS = 1.0  # time to measure the updates for each tested number of threads [s]
_THREADS = {
    SIMULATION: ("threads.simulator", "a step of the environments"),
    UPDATES: ("threads.torch", "a round of updates"),
}
"""For each part with threads, the setting and the task whose time is measured."""

_CHANGES_LEARNING = "This setting also affects the learned policy, so evaluate the policy again."


def advise(config: RunConfig, measured: MeasuredTraining) -> dict[str, str]:
    """Return advice for each setting that is worth changing or that limits the speed, given the measured times."""
    advice: dict[str, str | None] = {}
    if _can_matter(measured, SIMULATION):
        advice["num_envs"] = _advise_num_envs(config, measured)
        advice["threads.simulator"] = _advise_simulator_threads(config, measured)
    if _can_matter(measured, UPDATES):
        advice["threads.torch"] = _advise_torch_threads(config, measured)
        advice["algorithm_config.gradient_steps"] = _advise_gradient_steps(config, measured)
    return {setting: sentence for setting, sentence in advice.items() if sentence is not None}


def time_steps(config: RunConfig, num_envs: int, threads: int | None = None) -> float:
    """Return the median time of a vector environment step [s], with the configured or another number of threads."""
    changes: dict[str, Any] = {"num_envs": num_envs, "reset_from": None}
    if threads is not None:
        changes["threads"] = config.threads.model_copy(update={"simulator": threads})
    with closing(make_training_env(config.model_copy(update=changes))) as env:
        env.action_space.seed(0)
        env.reset(seed=0)
        times: list[float] = []
        end = perf_counter() + _TRY_SECONDS
        while len(times) < 8 or perf_counter() < end:
            actions = env.action_space.sample()
            start = perf_counter()
            env.step(actions)
            times.append(perf_counter() - start)
        return median(times[3:])


def _advise_num_envs(config: RunConfig, measured: MeasuredTraining) -> str | None:
    rates = _measure_sizes(config)
    size = choose_num_envs(rates)
    speedup = rates[size] / rates[config.total_envs]
    if size == config.total_envs or _speedup_of_run(measured, SIMULATION, speedup) < _WORTHWHILE:
        return None
    return (
        f"With num_envs={size} instead of {config.total_envs}, the environments run at {rates[size]:,.0f} instead of "
        f"{rates[config.total_envs]:,.0f} steps per second, so the training run would take "
        f"{_instead(config, measured, SIMULATION, speedup)}. {_CHANGES_LEARNING}"
    )


def _measure_sizes(config: RunConfig) -> dict[int, float]:
    """Return the environment steps per second for several values of ``num_envs``, including the configured value."""
    begin = perf_counter()
    rates = {config.total_envs: config.total_envs / time_steps(config, config.total_envs)}
    cost = perf_counter() - begin
    last = config.total_envs
    for size in _SIZES:
        if size == config.total_envs:
            continue
        if perf_counter() - begin + cost * max(1.0, size / last) > _SIZES_SECONDS:
            break
        start = perf_counter()
        try:
            rates[size] = size / time_steps(config, size)
        except FrobsError:  # a paced simulator supports only one environment
            break
        cost, last = perf_counter() - start, size
    return rates


def _advise_simulator_threads(config: RunConfig, measured: MeasuredTraining) -> str | None:
    decided = decide_threads(config)
    if decided.simulator is None:
        return None
    others = {1, min(decided.processors, config.total_envs)} - {decided.simulator}
    if not others:
        return None
    before = time_steps(config, config.total_envs)
    times = {threads: time_steps(config, config.total_envs, threads) for threads in others}
    return _advise_threads(config, measured, SIMULATION, decided.simulator, before, times)


def _advise_torch_threads(config: RunConfig, measured: MeasuredTraining) -> str | None:
    configured = config.algorithm_config.get("torch_threads")
    others = {1, decide_threads(config).processors} - {configured}
    if not (configured and others and measured.uses_torch):
        return None
    times = {threads: _time_updates(config, threads) for threads in others}
    return _advise_threads(config, measured, UPDATES, configured, median(measured.calls[UPDATES]), times)


def _advise_threads(
    config: RunConfig, measured: MeasuredTraining, part: str, configured: int, before: float, times: dict[int, float]
) -> str | None:
    """Return advice for the number of threads of one part, given its time [s] now and with other numbers of threads."""
    best = min(times, key=lambda threads: times[threads])
    if before / times[best] < _WORTHWHILE:
        return None
    setting, what = _THREADS[part]
    return (
        f"With {setting}={best} instead of {configured}, {what} takes {_milliseconds(times[best])} instead of "
        f"{_milliseconds(before)}, so the training run would take "
        f"{_instead(config, measured, part, before / times[best])}."
    )


def _time_updates(config: RunConfig, threads: int) -> float:
    settings = {**config.algorithm_config, "torch_threads": threads}
    changed = config.model_copy(update={"algorithm_config": settings})
    torch = sys.modules["torch"]  # the algorithm has already imported PyTorch, whose number of threads is global
    before = torch.get_num_threads()
    try:
        return median(measure_training(changed, seconds=_UPDATES_SECONDS, limit=2 * _UPDATES_SECONDS).calls[UPDATES])
    finally:
        torch.set_num_threads(before)


def _advise_gradient_steps(config: RunConfig, measured: MeasuredTraining) -> str | None:
    """Describe how the training time of an off-policy algorithm depends on ``gradient_steps``."""
    configured = config.algorithm_config.get("gradient_steps")
    if not configured:
        return None
    rounds = len(measured.calls[UPDATES])
    per_round = configured if configured > 0 else measured.steps // rounds  # -1: one per environment step
    gradient_step = measured.parts[UPDATES] / (rounds * per_round)
    vector_steps = measured.steps / config.total_envs
    affordable = measured.parts[SIMULATION] / vector_steps / gradient_step
    scaling = (
        f"A gradient step takes {_milliseconds(gradient_step)}. There are "
        f"{rounds * per_round / vector_steps:.3g} gradient steps per vector step, and simulating one vector "
        f"step takes as long as {affordable:.2g} gradient steps."
    )
    if measured.parts[UPDATES] < 0.5 * measured.seconds or per_round < 2:
        return scaling
    fewer = per_round // 2
    return (
        f"Updates take {100 * measured.parts[UPDATES] / measured.seconds:.0f} % of the time. With "
        f"gradient_steps={fewer} instead of {configured}, the training run would take "
        f"{_instead(config, measured, UPDATES, per_round / fewer)}. {_CHANGES_LEARNING} {scaling}"
    )


def _can_matter(measured: MeasuredTraining, part: str) -> bool:
    """Return whether eliminating a part's time would speed up the training run enough to suggest a change."""
    return measured.parts.get(part, 0.0) > (1.0 - 1.0 / _WORTHWHILE) * measured.seconds


def _speedup_of_run(measured: MeasuredTraining, part: str, speedup: float) -> float:
    saved = measured.parts[part] * (1.0 - 1.0 / speedup)
    return measured.seconds / (measured.seconds - saved)


def _instead(config: RunConfig, measured: MeasuredTraining, part: str, speedup: float) -> str:
    """Return the effect of one part's speedup on the training time, such as ``"52 s instead of 96 s"``."""
    now = config.steps * measured.per_step()
    return f"{duration(now / _speedup_of_run(measured, part, speedup))} instead of {duration(now)}"


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
