"""An MJCF document whose includes, defaults, compiler settings and file paths are resolved."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.budgets import Meter
from frobs_core.util.rotations import quat_from_axis_angle, quat_from_matrix, quat_multiply
from frobs_models.budgets import BUDGETS
from frobs_models.mjcf.limits import check_asset, check_numbers
from frobs_models.xmltree import Element, file_meter, parse_xml, read_bytes, suggestion

_ACTUATORS = (
    *("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion", "plugin"),
)
_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "skin": "meshdir", "texture": "texturedir"}
_TEXTURE_FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_MAIN = "main"

_DEPTH = BUDGETS["robot file"]["levels of nesting"]


class _Class(NamedTuple):
    """A default class: its attributes by tag, and the class whose attributes it inherits."""

    attributes: dict[str, dict[str, str]]
    parent: _Class | None


class MjcfDocument:
    """An MJCF document with resolved includes.

    Args:
        root: The ``<mujoco>`` element. Its includes are replaced by their contents, and its file paths are made
            absolute.
        path: The main file. As in MuJoCo, paths of includes and assets are relative to the folder of this file. If no
            file exists there, they are relative to the file that contains the element.

    Raises:
        ModelFileError: A file that the document refers to is missing or broken, or a limit is exceeded.
    """

    def __init__(self, root: Element, path: Path) -> None:
        self.root = root
        self.path = path
        self._meter = file_meter(path)
        _include(root, path, self._meter)
        check_numbers(root, self._meter)
        compiler = self.compiler = Element("compiler")
        compiler.file, compiler.line = path, None
        for element in root.children("compiler"):
            compiler.attrib.update(element.attrib)
            compiler.file, compiler.line = element.file, element.line
        self.degree = compiler.get("angle", "degree") != "radian"
        self.autolimits = compiler.get("autolimits", "true") == "true"
        self.sequence = compiler.get("eulerseq", "xyz")
        self._classes: dict[str, _Class] = {_MAIN: _Class({}, None)}
        for element in root.children("default"):
            self._read_defaults(element, _MAIN, self._classes[_MAIN])
            self._classes.setdefault(element.get("class", _MAIN), self._classes[_MAIN])
        self._resolve_files()
        assets = (self.with_defaults(mesh, None) for mesh in self.children("mesh", of="asset"))
        self.meshes = {mesh.get("name") or Path(mesh.get("file", "")).stem: mesh for mesh in assets}

    def children(self, *tags: str, of: str) -> Iterable[Element]:
        """Yield the children with the given tags from all sections with the tag ``of``, such as ``of="actuator"``."""
        for section in self.root.children(of):
            yield from section.children(*tags)

    def with_defaults(self, element: Element, childclass: str | None, tag: str = "") -> Element:
        """Return a copy of an element that includes the attributes of its default class.

        Args:
            element: The element.
            childclass: Default class of the body that contains the element.
            tag: Tag of the defaults. Defaults to the element's tag.
        """
        name = element.get("class") or childclass or _MAIN
        if name not in self._classes:
            element.refuse(f"the default class '{name}' does not exist.{suggestion(name, self._classes)}")
        cls, defaults = self._classes[name], []
        while cls.parent is not None:
            defaults.append(cls.attributes.get(tag or element.tag, {}))
            cls = cls.parent
        merged = Element(element.tag)
        for attributes in (*reversed(defaults), element.attrib):
            merged.attrib.update(attributes)
        self._meter.spend("inherited attributes", len(defaults) + sum(map(len, defaults)))
        merged.file, merged.line = element.file, element.line
        return merged

    def angle(self, value: float) -> float:
        """Convert an angle in the file's unit to radians."""
        return math.radians(value) if self.degree else value

    def orientation(self, element: Element) -> Floats:
        """Return the orientation that an element specifies, (4,), scalar first."""
        if "quat" in element.attrib:
            quat = np.array(element.numbers("quat", 4))
            return quat / self._length(element, "quat", quat)
        if "axisangle" in element.attrib:
            four = np.array(element.numbers("axisangle", 4))
            direction = four[:3] / self._length(element, "axisangle", four[:3])
            return quat_from_axis_angle(direction, self.angle(float(four[3])))
        if "euler" in element.attrib:
            return self._euler(element.numbers("euler", 3))
        if "xyaxes" in element.attrib:
            six = np.array(element.numbers("xyaxes", 6))
            x = six[:3] / self._length(element, "xyaxes", six[:3])
            y = six[3:] - (six[3:] * x).sum() * x
            y = y / self._length(element, "xyaxes", y)
            return quat_from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))
        if "zaxis" in element.attrib:
            axis = np.array(element.numbers("zaxis", 3))
            return shortest_from_z(axis / self._length(element, "zaxis", axis))
        return np.array([1.0, 0.0, 0.0, 0.0])

    def pose(self, element: Element) -> Floats:
        """Return the pose that an element specifies, (7,): position [m] and quaternion."""
        return np.concatenate([element.numbers("pos", 3, "0 0 0"), self.orientation(element)])

    def _euler(self, angles: tuple[float, ...]) -> Floats:
        quat = np.array([1.0, 0.0, 0.0, 0.0])
        for letter, angle in zip(self.sequence, angles, strict=True):
            turn = quat_from_axis_angle(np.eye(3)["xyz".index(letter.lower())], self.angle(angle))
            # lowercase letters rotate about the rotated axes, uppercase letters about the parent's axes
            quat = quat_multiply(quat, turn) if letter.islower() else quat_multiply(turn, quat)
        return quat

    def _length(self, element: Element, attribute: str, vector: Floats) -> float:
        length = math.sqrt(float((vector * vector).sum()))
        return length if length > 1e-9 else element.refuse(f'{attribute}="{element.get(attribute)}" is zero.')

    def _read_defaults(self, element: Element, name: str, parent: _Class) -> None:
        own = self._classes[name] = _Class({}, parent)
        for child in element.children():
            if child.tag != "default":
                tag = "actuator" if child.tag in _ACTUATORS else child.tag
                own.attributes.setdefault(tag, {}).update(child.attrib)
        for child in element.children("default"):
            self._read_defaults(child, child.required("class"), own)

    def _resolve_files(self) -> None:
        """Make the paths of assets absolute."""
        compiler = self.compiler
        strip = compiler.get("strippath", "false") == "true"
        for section in ("asset", "deformable"):
            for element in self.children(*_FOLDERS, of=section):
                folder = compiler.get(_FOLDERS[element.tag], compiler.get("assetdir", ""))
                for attribute in _TEXTURE_FILES:
                    name = element.get(attribute)
                    if not name:
                        continue
                    file = self.path.parent / folder / (Path(name).name if strip else name)
                    beside = element.file.parent / name  # MuJoCo ignores the compiler's folders here
                    if not file.exists() and not strip and beside.exists():
                        file = beside
                    if not file.exists():
                        element.refuse(f"the file '{name}' is missing: {file} does not exist.")
                    check_asset(element, file, self._meter)
                    element.set(attribute, str(file.resolve()))
        for element in self.root.children("compiler"):
            element.attrib.pop("strippath", None)


def shortest_from_z(axis: Floats) -> Floats:
    """Return the quaternion (4,) of the shortest rotation from z to a unit vector."""
    x, y, z = axis.tolist()
    sine = math.hypot(x, y)
    if sine < 1e-12:
        return np.array([1.0, 0.0, 0.0, 0.0] if z > 0 else [0.0, 1.0, 0.0, 0.0])
    return quat_from_axis_angle(np.array([-y / sine, x / sine, 0.0]), math.atan2(sine, z))


def _include(root: Element, path: Path, meter: Meter) -> None:
    """Replace every ``<include>`` with the included file's contents. As in MuJoCo, a file can be included only once."""
    seen, waiting = {path.resolve()}, [(root, 1)]
    while waiting:
        element, depth = waiting.pop()
        if depth > _DEPTH:
            element.refuse(f"elements are nested deeper than {_DEPTH} levels.")
        contents, unread = [], [*element.children()][::-1]
        while unread:
            child = unread.pop()
            if child.tag == "include":
                unread += [*_included(child, path.parent, seen, meter).children()][::-1]
            else:
                contents.append(child)
                waiting.append((child, depth + 1))
        element[:] = contents


def _included(element: Element, folder: Path, seen: set[Path], meter: Meter) -> Element:
    """Return the root of the file that an ``<include>`` refers to."""
    name = element.required("file")
    file = (folder / name).resolve()
    if not file.exists():
        file = (element.file.parent / name).resolve()
    if file in seen:
        element.refuse(f"'{file}' is already included.")
    if not file.exists():
        element.refuse(f"the file '{name}' is missing: {file} does not exist.")
    seen.add(file)
    meter.spend("included files")
    text = read_bytes(file)
    meter.spend("bytes", len(text))
    return parse_xml(text, file, meter=meter)
