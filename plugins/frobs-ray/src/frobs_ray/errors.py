"""Errors of this distribution.

    ConfigurationError
    ├── ClusterConnectionError  no Ray cluster responds or can be started
    ├── ClusterResourcesError   no node is large enough for a job
    ├── ClusterSizeError        the cluster has too few processors
    ├── EnvironmentCopyError    an environment cannot be recreated in another process
    └── NodesDifferError        nodes have different versions or no access to the shared folder
    RunError
    ├── EnvironmentRunnerError  no environment runner returns data
    └── RemoteJobError          a job failed on its node

Each constructor stores its arguments as attributes and composes the error message from them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from frobs_core.util.errors import ConfigurationError, RunError


class ClusterConnectionError(ConfigurationError):
    """No Ray cluster responds at an address, or no cluster can be started on this machine.

    Args:
        address: The address of the head node, or None for a cluster on this machine.
        cause: One-line description of the cause.
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


class ClusterResourcesError(ConfigurationError):
    """No node of the cluster has enough processors and memory for one job.

    Args:
        processors: Number of processors that a job requires.
        memory: Memory that a job requires [B].
        nodes: Resources of each node, as reported by Ray.
    """

    def __init__(self, processors: int, memory: int, nodes: Sequence[Mapping[str, float]]) -> None:
        self.processors = processors
        self.memory = memory
        self.nodes = tuple(nodes)
        most = max((node.get("CPU", 0) for node in nodes), default=0)
        largest = max((node.get("memory", 0) for node in nodes), default=0)
        super().__init__(
            f"a job needs {processors} processor{'s' if processors > 1 else ''} and {memory / 1e9:.1f} GB of memory, "
            f"but no node has enough of both (per node: at most {most:.0f} CPUs and {largest / 1e9:.1f} GB); lower "
            "--cpus or --memory, use a smaller algorithm_config.buffer_size, or add a larger node."
        )


class NodesDifferError(ConfigurationError):
    """Nodes of the cluster differ from this machine, so they cannot run the jobs.

    Args:
        problems: Descriptions of each node's problems, by the address of the node.
    """

    def __init__(self, problems: Mapping[str, Sequence[str]]) -> None:
        self.problems = {address: tuple(lines) for address, lines in problems.items()}
        text = "\n".join(f"  {address}: {'; '.join(lines)}" for address, lines in problems.items())
        super().__init__(
            f"these nodes of the cluster cannot run the jobs:\n{text}\n  Install the same versions of Python, FRobs and its "
            "plugins on every node, and use a folder that all nodes share under the same path."
        )


class RemoteJobError(RunError):
    """A job failed on its node.

    Args:
        name: Name of the job.
        message: Error message from the node.
        trace: Traceback from the node, which may be empty.
    """

    def __init__(self, name: str, message: str, trace: str) -> None:
        self.name = name
        self.message = message
        self.trace = trace
        super().__init__(message)


class ClusterSizeError(ConfigurationError):
    """A cluster has fewer processors than the environment runners need.

    Args:
        needed: Total number of processors that the environment runners need.
        available: Number of processors in the cluster.
    """

    def __init__(self, needed: int, available: int) -> None:
        self.needed = needed
        self.available = available
        super().__init__(
            f"num_env_runners × cpus_per_env_runner is {needed}, but the Ray cluster has only {available} CPUs. Reduce "
            "one of these settings, or add nodes with 'ray start --address=HOST:PORT'."
        )


class EnvironmentCopyError(ConfigurationError):
    """Environment runners in other processes cannot create the same environment.

    Args:
        cause: One-line description of the cause.
        remedy: Suggested alternative.
    """

    def __init__(self, cause: str, remedy: str) -> None:
        self.cause = cause
        self.remedy = remedy
        super().__init__(
            f"environment runners in other processes cannot make the same environment: {cause}. "
            f"Set num_env_runners to 0 to use the environment of this process, or {remedy}."
        )


class EnvironmentRunnerError(RunError):
    """No environment runner returns data.

    Args:
        cause: One-line description of the cause.
    """

    def __init__(self, cause: str) -> None:
        self.cause = " ".join(cause.split()).rstrip(".")
        super().__init__(f"no environment runner returns experience: {self.cause}.")
