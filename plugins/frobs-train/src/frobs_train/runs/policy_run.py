"""Use a policy that has no settings of its own, such as a scripted expert, through the interface of a training run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from frobs_core.util.validation import validate
from frobs_core.util.yaml import merge
from frobs_train.configuration.config import RunConfig
from frobs_train.configuration.resolve import read_setting
from frobs_train.runs.run import Run


class PolicyRun(Run):
    """A policy in an environment, used through the interface of a training run.

    Args:
        policy: Name or path of the policy, see :func:`~frobs_core.kernel.policies.load_policy`.
        environment: Gymnasium ID.
        settings: Assignments to keys of :class:`frobs_train.RunConfig`, such as ``"environment_kwargs.robot=ur5"``,
            ``"seed=3"`` or ``"wrappers=[…]"``.
        options: Options of the policy.

    Attributes:
        path: The path of the policy, or the ID if the policy has a name.

    Raises:
        ConfigurationError: A setting is invalid.
    """

    def __init__(self, policy: str | Path, environment: str, settings: Sequence[str] = (), **options: Any) -> None:
        self.policy, self.options = policy, options
        values = merge({"environment": environment, "seed": 0}, *(read_setting(setting) for setting in settings))
        config = validate(RunConfig, values, f"policy '{policy}'")
        super().__init__(Path(policy) if Path(policy).exists() else Path(environment), config)


class ExpertRun(PolicyRun):
    """The scripted, untrained expert of an environment's task. For the arguments, see :class:`PolicyRun`."""

    def __init__(self, environment: str, settings: Sequence[str] = ()) -> None:
        super().__init__("expert", environment, settings)
