"""Names in ROS's graph."""

from __future__ import annotations


def join(*parts: str | None) -> str:
    """Return a global name: ``join("/robot/", "controller_manager")`` is ``"/robot/controller_manager"``.

    Args:
        *parts: Names, with or without slashes around; None and ``"/"`` add nothing.
    """
    words = [word for part in parts for word in (part or "").split("/") if word]
    return "/" + "/".join(words)
