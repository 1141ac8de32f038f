"""Registration of services, whose handlers run in the simulation thread and report errors in their responses."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from frobs_core.util.errors import FrobsError, SimulationError
from frobs_ros.bridge.bridge import Bridge

LOG = logging.getLogger("frobs.bridge")


class Offers:
    """A group of services, which :meth:`close` shuts down."""

    def __init__(self, bridge: Bridge, prefix: str) -> None:
        self.bridge, self._prefix = bridge, prefix.rstrip("/")
        self._services: list[Any] = []

    def offer(self, name: str, kind: Any, handler: Callable[[Any], Any]) -> None:
        """Register a service.

        Args:
            name: Name without the prefix.
            kind: Class of the service.
            handler: Function that is called in the simulation thread with the request. The function returns a
                response, a dictionary of response fields, or None for an empty response. If the function raises a
                FrobsError, the response contains ``success=False`` and the error message. If the error is a
                SimulationError, or if this service's responses do not have these fields, the call fails instead.
        """
        import rospy

        answers = "status_message" in kind._response_class.__slots__

        def handle(request: Any) -> Any:
            try:
                result = self.bridge.call(lambda: handler(request))
            except FrobsError as error:
                LOG.warning("%s: %s", name, error)
                if not answers or isinstance(error, SimulationError):
                    raise rospy.ServiceException(str(error)) from error
                return kind._response_class(success=False, status_message=f"{kind.__name__}: {error}")
            return kind._response_class(**result) if isinstance(result, dict) else result or kind._response_class()

        self._services.append(rospy.Service(f"{self._prefix}/{name}", kind, handle))

    def close(self) -> None:
        """Shut down all services."""
        for service in self._services:
            service.shutdown("withdrawn")
        self._services.clear()


def done(text: str, **fields: Any) -> dict[str, Any]:
    """Return the fields of a successful response."""
    return {"success": True, "status_message": text, **fields}


def failed(text: str) -> dict[str, Any]:
    """Return the fields of a failed response."""
    LOG.warning(text)
    return {"success": False, "status_message": text}
