"""Joins and resolves names in the ROS graph."""

from __future__ import annotations


def join(*parts: str | None) -> str:
    """Join parts of a name into a global ROS name, such as ``"/robot/controller_manager"``.

    Args:
        *parts: Parts of the name, with or without leading and trailing slashes. None and ``"/"`` are ignored.
    """
    words = [word for part in parts for word in (part or "").split("/") if word]
    return "/" + "/".join(words)


def resolve(namespace: str, name: str) -> str:
    """Return the full name for a name in a namespace, which is empty or begins with a slash, but does not end with one.

    A name that begins with a slash is returned unchanged.
    """
    return name if name.startswith("/") else f"{namespace}/{name}"
