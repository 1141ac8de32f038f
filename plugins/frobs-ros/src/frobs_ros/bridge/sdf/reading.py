"""Functions that read the values of SDF elements and reject unsupported elements."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from frobs_core.util.errors import ModelFileError, nearest
from frobs_core.util.rotations import quat_from_rpy
from frobs_models import Element, Packages, parse_numbers, parse_xml, read_bytes
from frobs_ros.bridge.poses import WORLD, Place

_MODELS = Path("~/.gazebo/models")


def check(element: Element, read: Iterable[str], passed_over: Iterable[str] = ()) -> None:
    """Raise an error if an element has unsupported children.

    Args:
        element: The element.
        read: Tags of supported children.
        passed_over: Tags of children to ignore.

    Raises:
        ModelFileError: A child is not supported. The error message contains the child's tag and line.
    """
    known = {*read, *passed_over}
    for child in element.children():
        if child.tag not in known and ":" not in child.tag and not child.tag.startswith("{"):
            close = nearest(child.tag, sorted(known))
            hint = f" Did you mean <{close}>?" if close else ""
            child.refuse(f"the bridge does not support <{child.tag}> in {element.named()}; remove the element.{hint}")


def text_of(element: Element, path: str, default: str = "") -> str:
    """Return the stripped text at ``path`` within an element, or ``default`` if there is no text."""
    return (element.findtext(path) or default).strip()


def numbers_of(element: Element, path: str, default: str) -> list[float]:
    """Return the finite numbers at ``path`` within an element, or the numbers in ``default`` if there is no text.

    Raises:
        ModelFileError: The text and ``default`` do not contain the same number of finite values.
    """
    text = text_of(element, path, default) or default
    try:
        values = list(parse_numbers(text))
    except ValueError:
        element.refuse(f"expected a list of numbers in <{path}>, got '{text}'.")
    if len(values) != len(default.split()) or not all(map(math.isfinite, values)):
        element.refuse(f"expected {len(default.split())} finite numbers in <{path}>, got '{text}'.")
    return values


def number_of(element: Element, path: str, default: float) -> float:
    """Return the number at ``path`` within an element, or ``default`` if there is no text. The number may be ``inf``.

    Raises:
        ModelFileError: The text is not a number.
    """
    text = text_of(element, path)
    try:
        (value,) = parse_numbers(text) if text else (default,)
    except ValueError:
        element.refuse(f"expected a number in <{path}>, got '{text}'.")
    return value if not math.isnan(value) else element.refuse(f"<{path}> is nan.")


def says(element: Element, path: str, default: bool = False) -> bool:
    """Return whether the text at ``path`` is ``true`` or ``1``, or ``default`` if there is no text."""
    text = text_of(element, path).lower()
    return text in ("1", "true") if text else default


def place_of(element: Element) -> Place:
    """Return the ``<pose>`` of an element relative to the parent element.

    Raises:
        ModelFileError: The pose is relative to another frame or does not consist of six finite numbers.
    """
    pose = element.child("pose")
    if pose is None:
        return WORLD
    for attribute in ("frame", "relative_to"):
        if pose.get(attribute, "").strip():
            pose.refuse(
                f"the attribute {attribute}='{pose.get(attribute)}' is not supported; specify the pose relative to the "
                "parent element."
            )
    x, y, z, roll, pitch, yaw = numbers_of(element, "pose", "0 0 0 0 0 0")
    return Place(np.array([x, y, z]), quat_from_rpy((roll, pitch, yaw)))


def find_model(uri: str, element: Element) -> Path:
    """Find the SDF file of ``model://name`` in ``GAZEBO_MODEL_PATH`` or ``~/.gazebo/models``.

    Raises:
        ModelFileError: The file does not exist, or the URI does not begin with ``model://``.
    """
    if not uri.startswith("model://"):
        element.refuse(f"the URI '{uri}' is not supported; use model://NAME for a model on this machine.")
    name = uri.removeprefix("model://").strip("/")
    own = _MODELS.expanduser() / name
    folder = own if own.is_dir() else None
    try:
        folder = Packages(None, element.file).find(name)
    except ModelFileError as error:
        if folder is None:
            element.refuse(
                f"the model '{name}' was not found; add the parent folder of the folder '{name}' to "
                f"GAZEBO_MODEL_PATH. {error.reason}"
            )
    config = folder / "model.config"
    files = [item.text or "" for item in parse_xml(read_bytes(config), config).iter("sdf")] if config.is_file() else []
    file = folder / (files[-1].strip() if files else "model.sdf")
    return file if file.is_file() else element.refuse(f"the model '{name}' has no file {file}.")


def open_sdf(text: bytes | str, file: Path) -> Element:
    """Parse an SDF document and return the ``<sdf>`` element.

    Raises:
        ModelFileError: The document is invalid or is not an SDF document.
    """
    root = parse_xml(text, file)
    if root.tag != "sdf":
        root.refuse("the root element of an SDF file must be <sdf>.")
    check(root, ("model", "world", "light"))
    return root
