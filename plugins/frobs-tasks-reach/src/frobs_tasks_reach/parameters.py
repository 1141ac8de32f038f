"""Checking the parameters that users give: the core's checks, under the name that this package had them by."""

from frobs_core.parameters import boolean, box, finite, non_negative, number_list, numbers, positive

__all__ = ["boolean", "box", "finite", "non_negative", "number_list", "numbers", "positive"]
