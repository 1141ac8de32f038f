"""The controller manager of one robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from frobs_core.util.errors import ConfigurationError, FrobsError, UnknownNameError, check_name
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.controllers.controller import INTERFACES, Controller
from frobs_ros.bridge.controllers.types import TYPES
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.services.offer import Offers
from frobs_ros.errors import ControllerError

_STRICT = 2


class ControllerManager(Component):
    """Controller manager that loads, starts, stops and lists the controllers of one robot.

    Args:
        namespace: Namespace of the robot's topics and parameters, such as ``"/robot"``, or an empty string.
        find_parameters: Function that returns the value of a named ROS parameter, or None if the parameter is not set.
    """

    def __init__(self, bridge: Bridge, model: Model, namespace: str, find_parameters: Callable[[str], Any]) -> None:
        super().__init__()
        self._bridge, self._model, self._namespace = bridge, model, namespace
        self._find_parameters = find_parameters
        self.controllers: dict[str, Controller] = {}
        self._offers = Offers(bridge, f"{namespace}/controller_manager", "controller_manager_msgs")

    def offer(self) -> None:
        """Provide the manager's services."""
        tried = self._tried
        self._offers.offer(
            {
                "load_controller": ("LoadController", lambda _, request: tried(self.load, request.name)),
                "unload_controller": ("UnloadController", lambda _, request: tried(self.unload, request.name)),
                "switch_controller": ("SwitchController", lambda _, request: tried(self._switch, request)),
                "list_controllers": ("ListControllers", lambda *_: {"controller": self._list()}),
                "list_controller_types": ("ListControllerTypes", lambda *_: _list_types()),
                "reload_controller_libraries": (
                    "ReloadControllerLibraries",
                    lambda _, request: tried(self._reload, request.force_kill),
                ),
            }
        )

    def active(self) -> list[Controller]:
        """Return the running controllers."""
        return [self.controllers[name] for name in self._running()]

    def load(self, name: str) -> None:
        """Create a controller from its parameters on the ROS parameter server.

        Raises:
            ConfigurationError: The controller is already loaded, its type is not set, or a parameter is invalid.
            UnknownNameError: The controller type or a joint does not exist.
        """
        if name in self.controllers:
            raise ControllerError(name, "the controller is already loaded.")
        topic = f"{self._namespace}/{name}"
        parameters = self._find_parameters(topic)
        kind = parameters.get("type") if isinstance(parameters, Mapping) else None
        if not isinstance(parameters, Mapping) or not kind:
            raise ControllerError(
                name,
                f"the parameter {topic}/type is not set; load the controller's YAML file into the namespace "
                f"'{self._namespace or '/'}' first.",
            )
        check_name("type of controller", kind, TYPES)
        self.controllers[name] = TYPES[kind](self._model, topic, parameters)
        self.controllers[name].kind = kind

    def unload(self, name: str) -> None:
        """Remove a controller.

        Raises:
            UnknownNameError: The controller is not loaded.
            ConfigurationError: The controller is running.
        """
        check_name("loaded controller", name, self.controllers)
        if self.controllers[name].state == "running":
            raise ControllerError(name, "a running controller cannot be unloaded; stop it first.")
        self.controllers.pop(name).close()

    def switch(self, start: list[str], stop: list[str], strict: bool) -> None:
        """Stop some controllers and start others at the same time.

        Args:
            start: Names of controllers to start.
            stop: Names of controllers to stop.
            strict: Whether to reject the whole call if a controller cannot be started or stopped. Otherwise, such
                controllers are ignored.

        Raises:
            UnknownNameError: ``strict`` is True, and a controller is not loaded.
            ConfigurationError: Two controllers would claim the same joint, or ``strict`` is True and a controller is
                already in the requested state.
        """
        ending = [name for name in stop if self._may(name, True, strict, "is not running")]
        restarted = set(ending)
        beginning = [name for name in start if name in restarted or self._may(name, False, strict, "is running")]
        after = set(self._running()) - set(ending) | set(beginning)
        owners: dict[str, str] = {}
        for name in sorted(after):
            for joint in self.controllers[name].joints:
                if joint in owners:
                    raise ControllerError(
                        name,
                        f"the joint '{joint}' is also claimed by controller '{owners[joint]}'; stop one of the two.",
                    )
                owners[joint] = name
        for name in dict.fromkeys(ending):
            self.controllers[name].stop(self._bridge.world)
            self.controllers[name].state = "stopped"
        for name in dict.fromkeys(beginning):
            self.controllers[name].start(self._bridge.world)
            self.controllers[name].state = "running"

    def close(self) -> None:
        """Shut down the services and remove all controllers."""
        self._offers.close()
        for controller in self.controllers.values():
            controller.close()
        self.controllers.clear()

    def _running(self) -> list[str]:
        return [name for name, controller in self.controllers.items() if controller.state == "running"]

    def _may(self, name: str, running: bool, strict: bool, complaint: str) -> bool:
        """Return whether a controller is loaded and can be started or stopped.

        If ``strict`` is True, raise an error instead of returning False.
        """
        if name not in self.controllers:
            if strict:
                raise UnknownNameError("loaded controller", name, self.controllers)
            LOG.warning("switch_controller: controller '%s' is ignored because it is not loaded", name)
            return False
        fits = (self.controllers[name].state == "running") is running
        if not fits and strict:
            raise ControllerError(name, f"the controller {complaint}; no controller was started or stopped.")
        return fits

    def _switch(self, request: Any) -> None:
        self.switch(list(request.start_controllers), list(request.stop_controllers), request.strictness == _STRICT)

    def _reload(self, force: bool) -> None:
        if self.active() and not force:
            raise ConfigurationError(
                "the controllers cannot be reloaded while they are running; stop them first, or set force_kill."
            )
        self.switch([], self._running(), strict=False)
        for name in list(self.controllers):
            self.unload(name)

    def _tried(self, act: Callable[[Any], None], given: Any) -> dict[str, bool]:
        try:
            act(given)
        except FrobsError as error:
            LOG.error("%s/controller_manager: %s", self._namespace, error)
            return {"ok": False}
        return {"ok": True}

    def _list(self) -> list[Any]:
        from controller_manager_msgs.msg import ControllerState, HardwareInterfaceResources

        states = []
        for name, controller in self.controllers.items():
            mode = controller.interface
            interface = INTERFACES[mode] if mode else "hardware_interface::JointStateInterface"
            resources = [HardwareInterfaceResources(hardware_interface=interface, resources=list(controller.joints))]
            states.append(ControllerState(name, controller.state, controller.kind, resources))
        return states


def _list_types() -> dict[str, list[str]]:
    return {"types": list(TYPES), "base_classes": ["controller_interface::ControllerBase"] * len(TYPES)}
