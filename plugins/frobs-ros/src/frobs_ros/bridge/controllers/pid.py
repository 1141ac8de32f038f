"""PID controller for several joints, with the same parameters as in ros_control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError


class Pid:
    """PID controller for k joints.

    The limit on the integral term is symmetric and always prevents windup, so ``i_min`` and ``antiwindup`` are ignored.

    Args:
        parameters: Parameters of each joint: ``p``, ``i``, ``d``, and ``i_clamp`` or ``i_max``, where 0 means no limit.
        where: Description of the controller for error messages.

    Raises:
        ConfigurationError: A joint has no gains, or a gain is not a number.
    """

    def __init__(self, parameters: Sequence[Mapping[str, Any]], where: str) -> None:
        rows = []
        for given in parameters:
            if not isinstance(given, Mapping) or "p" not in given:
                raise ConfigurationError(f"{where} has no PID gains; set p, i and d for each joint.")
            try:
                clamp = abs(float(given.get("i_clamp", given.get("i_max", 0.0))))
                rows.append([*(float(given.get(name, 0.0)) for name in "pid"), clamp])
            except (TypeError, ValueError) as error:
                raise ConfigurationError(f"{where}: a gain is not a number: {dict(given)}.") from error
        self.p, self.i, self.d, self.clamp = np.array(rows, np.float64).T
        self._sum: Floats = np.zeros(len(rows))

    def __call__(self, error: Floats, error_rate: Floats, timestep: float) -> Floats:
        """Return the command.

        Args:
            error: (k,) target minus value.
            error_rate: (k,) time derivative of the error.
            timestep: Time since the last call [s].
        """
        self._sum = self._sum + error * timestep
        integral = self.i * self._sum
        limited = np.where(self.clamp > 0.0, np.clip(integral, -self.clamp, self.clamp), integral)
        # Also limit the stored sum, to prevent integral windup.
        self._sum = np.divide(limited, self.i, out=np.zeros_like(limited), where=self.i != 0.0)
        command: Floats = self.p * error + limited + self.d * error_rate
        return command

    def reset(self) -> None:
        """Clear the integral."""
        self._sum[:] = 0.0
