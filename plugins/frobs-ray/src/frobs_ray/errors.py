"""Errors of this distribution.

    ConfigurationError
    └── ClusterConnectionError  no Ray cluster answers, or none can be started

Each takes the objects it is about, keeps them as fields, and writes its own text.
"""

from __future__ import annotations

from frobs_core.errors import ConfigurationError


class ClusterConnectionError(ConfigurationError):
    """No Ray cluster answers at an address, or no cluster can be started on this machine.

    Args:
        address: The address of the head node; None: a cluster on this machine.
        cause: One line that says why.
    """

    def __init__(self, address: str | None, cause: str) -> None:
        self.address = address
        self.cause = " ".join(cause.split()).rstrip(".")
        if address is None:
            text = f"cannot start Ray on this machine: {self.cause}."
        else:
            text = (
                f"cannot connect to the Ray cluster at '{address}': {self.cause}. Start its head node with 'ray start "
                "--head', check the address with 'ray status', or omit the address to use this machine only."
            )
        super().__init__(text)
