"""Limits on actions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from frobs_deploy.errors import BundleError, BundleMismatchError, PolicyArgumentError
from frobs_deploy.manifest import Manifest
from frobs_deploy.spaces import Array, as_floats


class ActionLimits:
    """Clips actions to their space, and limits their change per step.

    ``max_change`` is ``"joint_velocity"`` for the change that the joints' velocity limits allow, a number or an array
    of the action's shape in the action's unit, or None for no limit.
    """

    def __init__(self, path: Path, manifest: Manifest, max_change: str | float | Array | None) -> None:
        self._path, self._space = path, manifest.action
        self.max_change = None if max_change is None else self._changes(manifest, max_change)
        self._previous: Array | None = None

    def reset(self, previous: Array | None) -> None:
        """Forget the previous action, or set it, (n, …)."""
        self._previous = previous

    def forget(self, mask: Array) -> None:
        """Remove the limit on the change of the next actions of some rows."""
        if self._previous is not None:
            self._previous = np.where(mask.reshape(-1, *[1] * len(self._space.shape)), np.nan, self._previous)

    def apply(self, action: Array) -> Array:
        """Return actions, (n, …), inside the limits, of the space's dtype; raise BundleError if one is not finite."""
        if self._space.discrete:
            return action.astype(self._space.dtype, copy=False)
        if not np.isfinite(action).all():
            raise BundleError(
                self._path, "the policy's action is not finite; the network has diverged; train it again."
            )
        limited = np.clip(action, self._space.low, self._space.high)
        if self.max_change is not None and self._previous is not None:
            near = np.clip(limited, self._previous - self.max_change, self._previous + self.max_change)
            limited = np.where(np.isnan(self._previous), limited, near)
        self._previous = limited
        return limited.astype(self._space.dtype)

    def _changes(self, manifest: Manifest, given: Any) -> Array:
        if self._space.discrete:
            raise PolicyArgumentError(
                f"max_change={given!r}: the policy's actions are discrete, so their change cannot be limited."
            )
        if isinstance(given, str):
            if given != "joint_velocity":
                raise PolicyArgumentError(f"max_change={given!r}: it must be 'joint_velocity', a number or an array.")
            if manifest.max_action_change is None:
                raise BundleMismatchError(
                    self._path,
                    "max_change='joint_velocity': the actions of this policy are not joint positions; "
                    "pass numbers in the action's unit.",
                )
            return manifest.max_action_change
        changes = as_floats("max_change", given)
        if changes.shape not in ((), self._space.shape) or not (changes > 0.0).all():
            raise PolicyArgumentError(
                f"max_change={given!r}: it must be above 0, one number or an array of shape {self._space.shape}."
            )
        return np.broadcast_to(changes, self._space.shape)
