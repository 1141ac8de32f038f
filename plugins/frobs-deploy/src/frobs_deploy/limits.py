"""Limits the actions of a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from frobs_deploy.errors import BundleError, BundleMismatchError, PolicyArgumentError
from frobs_deploy.manifest import Manifest
from frobs_deploy.spaces import Array, as_floats


class ActionLimits:
    """Clips actions to the action space, and limits the change from one action to the next.

    Args:
        path: Path of the bundle file, for error messages.
        manifest: Manifest of the bundle.
        max_change: Maximum change per step in the action's unit, as a number or an array of the action's shape.
            ``"joint_velocity"`` selects the change that the joints' velocity limits allow, and None means no limit.
    """

    def __init__(self, path: Path, manifest: Manifest, max_change: str | float | Array | None) -> None:
        self._path, self._space = path, manifest.action
        self.max_change = None if max_change is None else self._changes(manifest, max_change)
        self._previous: Array | None = None

    def reset(self, previous: Array | None) -> None:
        """Set the previous actions, (n, …), or clear them if ``previous`` is None."""
        self._previous = previous

    def forget(self, mask: Array) -> None:
        """Clear the previous actions in the masked rows, so that the next actions in these rows can change freely."""
        if self._previous is not None:
            self._previous = np.where(mask.reshape(-1, *[1] * len(self._space.shape)), np.nan, self._previous)

    def apply(self, action: Array) -> Array:
        """Limit actions, (n, …), and return them with the dtype of the action space.

        Raises:
            BundleError: An action is not finite.
        """
        if self._space.discrete:
            return action.astype(self._space.dtype, copy=False)
        if not np.isfinite(action).all():
            raise BundleError(
                self._path,
                "the policy returned an action that is not finite, because its network diverged; train the policy "
                "again.",
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
                f"max_change is {given!r}, but discrete actions cannot be limited; omit max_change."
            )
        if isinstance(given, str):
            if given != "joint_velocity":
                raise PolicyArgumentError(
                    f"max_change is {given!r}; it must be 'joint_velocity', a number or an array."
                )
            if manifest.max_action_change is None:
                raise BundleMismatchError(
                    self._path,
                    "max_change='joint_velocity' is not supported, because the actions of this policy are not joint "
                    "positions; pass numbers in the action's unit.",
                )
            return manifest.max_action_change
        changes = as_floats("max_change", given)
        if changes.shape not in ((), self._space.shape) or not (changes > 0.0).all():
            raise PolicyArgumentError(
                f"max_change is {given!r}; it must be a positive number, or an array of positive numbers with shape "
                f"{self._space.shape}."
            )
        return np.broadcast_to(changes, self._space.shape)
