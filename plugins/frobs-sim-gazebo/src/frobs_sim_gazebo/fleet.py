"""Manages the Gazebo servers of a simulation, with one server per environment."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from frobs_core.util.errors import SimulationError
from frobs_sim_gazebo.build import built_plugin
from frobs_sim_gazebo.installation import Installation
from frobs_sim_gazebo.protocol import Op
from frobs_sim_gazebo.server import Server, ServerError

_log = logging.getLogger(__name__)
_AT_ONCE = 8  # maximum number of servers that start simultaneously
_MOST_LOST = 3  # an error is raised if an environment loses this many servers in a row, with no step in between

Message = tuple[Op, bytes]


class Fleet:
    """The Gazebo servers of a simulation, with one server per environment.

    Args:
        installation: Gazebo installation.
        count: Number of servers.
        world: Text of the world file that the servers load.
        prepare: Function that populates a server's world. The function is called in a separate thread.

    Raises:
        SimulationError: A server did not start. All other servers were stopped.
    """

    def __init__(self, installation: Installation, count: int, world: bytes, prepare: Callable[[Server], None]) -> None:
        self._installation, self._world, self._prepare = installation, world, prepare
        self._servers: list[Server | None] = [None] * count
        self._lost = [0] * count
        built_plugin(installation)
        self._start(range(count), self._started)

    def server(self, env: int) -> Server | None:
        """Return an environment's server, or None if the server was lost."""
        return self._servers[env]

    def replace(self, envs: Sequence[int]) -> None:
        """Start new servers for environments whose servers were lost.

        Raises:
            SimulationError: An environment lost too many servers in a row. All servers were stopped.
        """
        self._start(envs, self._replaced)

    def _start(self, envs: Sequence[int], starter: Callable[[int], None]) -> None:
        if not envs:
            return
        try:
            with ThreadPoolExecutor(min(_AT_ONCE, len(envs)), "frobs-gazebo") as pool:
                list(pool.map(starter, envs))
        except BaseException:
            self.close()
            raise

    def _started(self, env: int) -> None:
        server = Server(self._installation, self._world)
        self._servers[env] = server  # stored first, so that close() also closes this server if the preparation fails
        self._prepare(server)

    def _replaced(self, env: int) -> None:
        """Start a new server for an environment, and retry failed starts up to the limit of consecutive losses."""
        while True:
            try:
                return self._started(env)
            except ServerError as error:
                self._count_loss(env, error)
                _log.error("environment %d lost another Gazebo server during its start: %s", env, error)

    def exchange(self, messages: Mapping[int, Sequence[Message]], steps: int = 0) -> dict[int, bytes]:
        """Send messages to environments, and return the answer to each environment's last message.

        If a server exits or hangs, the failure is logged. The server's environment is omitted from the results until
        :meth:`replace` starts a new server.

        Args:
            messages: Messages, by environment.
            steps: Number of physics steps requested by each environment's last message.

        Raises:
            SimulationError: A server rejected a message, or an environment lost too many servers in a row.
        """
        sent, answers = [], {}
        refusal: SimulationError | None = None
        for env, own in messages.items():
            server = self._servers[env]
            if server is None:
                continue
            try:
                for op, body in own:
                    server.send(op, body)
                sent.append((env, server, len(own)))
            except ServerError as error:
                self._lose(env, error)
        for env, server, count in sent:
            for k in range(count):
                try:
                    answers[env] = server.receive(steps=steps if k == count - 1 else 0)
                except ServerError as error:
                    answers.pop(env, None)
                    self._lose(env, error)
                    break
                except SimulationError as error:
                    refusal = error  # raised later, because the remaining answers must be read first
        if refusal is not None:
            raise refusal
        if steps:
            for env in answers:
                self._lost[env] = 0
        return answers

    def _lose(self, env: int, error: ServerError) -> None:
        try:
            self._count_loss(env, error)
        except SimulationError:
            self.close()
            raise
        _log.error(
            "environment %d lost its Gazebo server: %s\nIts episode is truncated; the next reset starts another server.",
            env,
            error,
        )

    def _count_loss(self, env: int, error: ServerError) -> None:
        self._servers[env] = None
        self._lost[env] += 1
        if self._lost[env] >= _MOST_LOST:
            raise SimulationError(
                f"environment {env} lost {_MOST_LOST} consecutive Gazebo servers; the last failure: {error}"
            ) from error

    def close(self) -> None:
        """Stop all servers. Repeated calls have no effect."""
        for env, server in enumerate(self._servers):
            if server is not None:
                server.close()
                self._servers[env] = None
