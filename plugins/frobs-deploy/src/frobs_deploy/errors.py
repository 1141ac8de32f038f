"""Exceptions raised when running exported policies.

DeployError
├── BundleError                 a policy bundle cannot be used
│   └── BundleMismatchError     a policy bundle does not match the robot, control rate, observation or action space
├── PolicyArgumentError         an argument has the wrong shape or value
└── OnnxruntimeMissingError     onnxruntime is not installed
"""

from __future__ import annotations

from pathlib import Path


class DeployError(Exception):
    """Base class of all errors that this package raises intentionally."""


class BundleError(DeployError):
    """A policy bundle cannot be used.

    Args:
        path: Path of the bundle file.
        reason: Message that describes the problem and how to fix it.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")


class BundleMismatchError(BundleError):
    """A valid policy bundle does not match the robot, control rate, observation or action space."""


class PolicyArgumentError(DeployError, ValueError):
    """An argument has the wrong shape or value."""


class OnnxruntimeMissingError(DeployError, ImportError):
    """onnxruntime is not installed."""

    def __init__(self) -> None:
        super().__init__("running a policy bundle needs onnxruntime; install it with 'pip install onnxruntime'.")
