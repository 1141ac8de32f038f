"""Implements FRobs_RL's ``ros_controllers``: loads, starts, stops, resets and unloads a robot's controllers.

Most functions return whether they succeeded. If a function fails, the reason is logged.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Sequence
from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.ros.arguments import with_parameters
from frobs_rl_compat.ros.logged_errors import answers, or_raise
from frobs_ros.errors import ServiceError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.names import join
from frobs_ros.ros.services import call

_PAUSE = 0.05
STRICTNESS = {1: "best effort", 2: "strict"}


@answers(False, vital=True)
def load_controller_srv(controller_name: str, ns: str | None = None, max_retries: int = 5) -> bool:
    """Load a controller, unless it is already loaded."""
    use_ros()
    from controller_manager_msgs.srv import LoadController

    service = join(ns, "controller_manager", "load_controller")

    def is_loaded() -> bool:
        answer = call(service, LoadController, controller_name, tries=max_retries)
        return bool(answer.ok) or controller_name in _states(ns)

    if _try(is_loaded, max_retries):
        return True
    raise ServiceError(service, f"it rejects '{controller_name}': {_why_not_loaded(controller_name, ns)}")


@answers(None)
def load_controller_list_srv(controller_list: Sequence[str], ns: str | None = None, max_retries: int = 5) -> None:
    """Load several controllers."""
    for controller in controller_list:
        load_controller_srv(controller, ns, max_retries)


@answers(False)
def unload_controller_srv(controller_name: str, ns: str | None = None, max_retries: int = 5) -> bool:
    """Unload a controller that is not running."""
    use_ros()
    from controller_manager_msgs.srv import UnloadController

    service = join(ns, "controller_manager", "unload_controller")
    if _try(lambda: call(service, UnloadController, controller_name, tries=max_retries).ok, max_retries):
        return True
    state = _states(ns).get(controller_name)
    reason = "no such controller is loaded" if state is None else f"it is {state}; stop it first"
    raise ServiceError(service, f"it rejects '{controller_name}': {reason}. {_loaded(ns)}")


@answers(None)
def unload_controller_list_srv(controller_list: Sequence[str], ns: str | None = None, max_retries: int = 5) -> None:
    """Unload several controllers that are not running."""
    for controller in controller_list:
        unload_controller_srv(controller, ns, max_retries)


@answers(False, vital=True)
def switch_controllers_srv(
    start_controllers: Sequence[str],
    stop_controllers: Sequence[str],
    ns: str | None = None,
    strictness: int = 1,
    start_asap: bool = False,
    timeout: float = 3.0,
    max_retries: int = 5,
) -> bool:
    """Start some controllers and stop others, in a single call to the controller manager."""
    use_ros()
    from controller_manager_msgs.srv import SwitchController

    if strictness not in STRICTNESS:
        raise ParameterValueError("strictness", strictness, "1 (best effort) or 2 (strict)")
    if timeout < 0:
        raise ParameterValueError("timeout", timeout, "at least 0 s, where 0 means no limit")
    start, stop = list(start_controllers or ()), list(stop_controllers or ())
    service = join(ns, "controller_manager", "switch_controller")
    fields = (start, stop, strictness, start_asap, timeout)
    done = _try(lambda: call(service, SwitchController, *fields, tries=max_retries).ok, max_retries)
    # In best-effort mode, the controller manager accepts unknown names.
    states = _states(ns)
    idle = [name for name in start if states.get(name) != "running"]
    busy = [name for name in stop if states.get(name) == "running" and name not in start]
    if done and not idle and not busy:
        return True
    wrong = [f"'{name}' is {states.get(name, 'not loaded')} but should be running" for name in idle]
    wrong += [f"'{name}' is still running" for name in busy]
    raise ServiceError(
        service,
        f"{', '.join(wrong) or 'the controller manager rejected the request without giving a reason'}. {_loaded(ns)}",
    )


def _options(ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0) -> None:
    """Parameters that the functions below have in common."""


def _switches(*, vital: bool = False) -> Callable[[Callable[..., bool]], Callable[..., bool]]:
    """Decorate a function that starts or stops controllers."""
    added = inspect.signature(_options).parameters.values()
    return lambda function: answers(False, vital=vital)(with_parameters(function, added))


@_switches(vital=True)
def start_controllers_srv(start_controllers: Sequence[str], **options: Any) -> bool:
    """Start controllers that are loaded."""
    return or_raise(switch_controllers_srv)(start_controllers, [], **options)


@_switches()
def stop_controllers_srv(stop_controllers: Sequence[str], **options: Any) -> bool:
    """Stop controllers."""
    return or_raise(switch_controllers_srv)([], stop_controllers, **options)


@_switches()
def reset_controllers_srv(reset_controllers: Sequence[str], max_retries: int = 10, **options: Any) -> bool:
    """Stop and restart controllers."""
    switch = or_raise(switch_controllers_srv)
    switch([], reset_controllers, **options, max_retries=max_retries)
    return switch(reset_controllers, [], **options, max_retries=max_retries)


@_switches(vital=True)
def spawn_controllers_srv(spawn_controllers: Sequence[str], **options: Any) -> bool:
    """Load and start controllers."""
    for controller in spawn_controllers:
        or_raise(load_controller_srv)(controller, options.get("ns"))
    return or_raise(start_controllers_srv)(spawn_controllers, **options)


@_switches()
def kill_controllers_srv(kill_controllers: Sequence[str], **options: Any) -> bool:
    """Stop and unload controllers."""
    or_raise(stop_controllers_srv)(kill_controllers, **options)
    for controller in kill_controllers:
        or_raise(unload_controller_srv)(controller, options.get("ns"))
    return True


def _try(ask: Callable[[], bool], tries: int) -> bool:
    """Repeat a request until it succeeds, at most ``tries`` times, and return whether it succeeded."""
    for attempt in range(max(tries, 1)):
        if attempt:
            time.sleep(_PAUSE)
        if ask():
            return True
    return False


def _states(ns: str | None) -> dict[str, str]:
    from controller_manager_msgs.srv import ListControllers

    listed = call(join(ns, "controller_manager", "list_controllers"), ListControllers)
    return {controller.name: controller.state for controller in listed.controller}


def _loaded(ns: str | None) -> str:
    states = _states(ns)
    return f"Loaded controllers: {', '.join(f'{name} ({state})' for name, state in states.items()) or 'none'}."


def _why_not_loaded(controller: str, ns: str | None) -> str:
    from controller_manager_msgs.srv import ListControllerTypes

    from frobs_ros.ros.master import connect

    parameter = join(ns, controller, "type")
    master = connect()
    if not master.hasParam(parameter):
        return (
            f"the parameter {parameter} is missing; load the controllers' YAML file into the namespace {join(ns)} first"
        )
    kind = master.getParam(parameter)
    types = call(join(ns, "controller_manager", "list_controller_types"), ListControllerTypes).types
    if kind not in types:
        return f"there is no controller type '{kind}'; available types: {', '.join(sorted(types))}"
    return "see the log of the controller manager"
