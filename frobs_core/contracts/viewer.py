"""Contract of viewers, which show an environment to a person while it runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any


class Viewer(ABC):
    """Shows one environment, or one environment of a vector environment at a time.

    A viewer is created without arguments when an environment is created with its name as ``render_mode``. It reads the
    environment and must not change any state that a training run depends on.
    """

    @abstractmethod
    def bind(self, env: Any) -> None:
        """Begin to show an environment. Called once, before the first reset.

        Args:
            env: The :class:`~frobs_core.kernel.env.RobotEnv` or
                :class:`~frobs_core.kernel.vector_env.RobotVectorEnv`, without wrappers.

        Raises:
            FrobsError: The environment cannot be shown, for example because there is no display.
        """

    @abstractmethod
    def update(self) -> None:
        """Show the current state. Called after each reset and after each control step, by the thread of the environment.

        Raises:
            RenderingUnavailableError: There is no display.
        """

    @abstractmethod
    def close(self) -> None:
        """Release windows, ports and threads. Repeated calls have no effect."""


class EngineWindow(Viewer):
    """The window of the simulator itself, which the simulator updates at each step."""

    def bind(self, env: Any) -> None:
        self._simulation = env.simulation

    def update(self) -> None:
        """Open the window after the first reset, and show the initial state after each reset."""
        if self._simulation.time[0] <= 0.0:
            self._simulation.open_viewer()

    def close(self) -> None:
        """Do nothing, because the simulation closes its window."""
