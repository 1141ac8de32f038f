"""Registration of services, whose handlers run in the simulation thread and report errors in their responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

from frobs_core.util.errors import ConfigurationError, FrobsError, SimulationError, UnknownNameError
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.messages.types import find_type

Handler = Callable[[Bridge, Any], Mapping[str, Any] | None]
Services = Mapping[str, tuple[str, Handler]]
"""Type and handler of each service, by the service's name without the prefix.

A type without a package, such as ``"GetLinkState"``, belongs to the default package. Others are like ``"std_srvs/Empty"``.
"""

_Found = TypeVar("_Found")


class Offers:
    """A group of services, which :meth:`close` shuts down.

    Args:
        bridge: Bridge that the handlers use.
        prefix: Prefix of the services' names.
        package: Package of the service types.
    """

    def __init__(self, bridge: Bridge, prefix: str, package: str = "gazebo_msgs") -> None:
        self._bridge, self._prefix, self._package = bridge, prefix.rstrip("/"), package
        self._services: list[Any] = []

    def offer(self, services: Services) -> None:
        """Register services.

        Args:
            services: Types and handlers. A handler is called in the simulation thread with the bridge and the request.
                The handler returns a dictionary of response fields, or None for an empty response. If the handler
                raises a FrobsError, the response contains ``success=False`` and the error message. If the error is a
                SimulationError, or if the service's responses do not have these fields, the call fails instead.
        """
        import rospy

        for name, (kind, handler) in services.items():
            service = find_type(kind if "/" in kind else f"{self._package}/{kind}", "srv")
            handle = partial(self._handle, name, service, handler)
            self._services.append(rospy.Service(f"{self._prefix}/{name}", service, handle))

    def _handle(self, name: str, kind: Any, handler: Handler, request: Any) -> Any:
        import rospy

        response = kind._response_class
        try:
            return response(**(self._bridge.call(lambda: handler(self._bridge, request)) or {}))
        except FrobsError as error:
            LOG.warning("%s: %s", name, error)
            if "status_message" not in response.__slots__ or isinstance(error, SimulationError):
                raise rospy.ServiceException(str(error)) from error
            return response(success=False, status_message=f"{kind.__name__}: {error}")

    def close(self) -> None:
        """Shut down all services."""
        for service in self._services:
            service.shutdown("withdrawn")
        self._services.clear()


def done(text: str, **fields: Any) -> dict[str, Any]:
    """Return the fields of a successful response."""
    return {"success": True, "status_message": text, **fields}


def found(find: Callable[[str], _Found], name: str, problem: str, *, explain: bool = False) -> _Found:
    """Return the result of ``find(name)``.

    Args:
        find: Function that raises an UnknownNameError if the name is unknown.
        name: Name to find.
        problem: Message for an unknown name.
        explain: Whether to append the message of the UnknownNameError.

    Raises:
        ConfigurationError: The name is unknown.
    """
    try:
        return find(name)
    except UnknownNameError as error:
        raise ConfigurationError(f"{problem} {error}" if explain else problem) from error
