"""MJCF reader for the kinematic tree, masses and shapes. MuJoCo itself reads all other content from the same file.

In ``RobotModel.xml``, includes are resolved and file paths are absolute. The world contains a single body, the root
link, which either has a free joint or no joint. If the world in the file does not have this form, its bodies, sites and
geoms (except planes and height fields) are moved into a new body named ``base``.

A body with several joints becomes a chain of links. The additional links are named ``body__1``, ``body__2``, …, and
have no mass.

If the file has actuators that act on joints, joints without an actuator are passive, which means that they have no
drive.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from frobs_core.models import (
    Inertial,
    Joint,
    JointLimits,
    JointType,
    Link,
    Mimic,
    RobotModel,
    compose,
    pose_array,
    pose_from_array,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_from_axis_angle
from frobs_models.mjcf.document import MjcfDocument
from frobs_models.mjcf.geoms import Geom, body_inertial, body_link, compiled_inertials, read_geom, weighed
from frobs_models.notes import Notes
from frobs_models.tree import check_count, flatten_mimics
from frobs_models.xmltree import Element, to_text

# Elements that generate bodies and joints not listed in the file
_UNREADABLE = ("replicate", "attach", "composite", "flexcomp", "model")
_LEFT_OUT = {"actuator": "actuators", "sensor": "sensor", "keyframe": "keyframes", "option": "engine-settings"}
_PHYSICS = {
    "gravity": "0 0 -9.81",
    "density": "0",
    "viscosity": "0",
    "wind": "0 0 0",
    "magnetic": "0 -0.5 0",
    "impratio": "1",
    "cone": "pyramidal",
}
"""Attributes of ``<option>`` that affect a robot's motion, with MuJoCo's defaults."""
_DISABLING = (
    "constraint equality frictionloss limit contact passive spring damper gravity clampctrl filterparent actuation"
)
_FLAGS = {"override": "enable", **dict.fromkeys(_DISABLING.split(), "disable")}
"""Attributes of ``<flag>`` that affect a robot's motion, with the opposite of MuJoCo's default value."""
_IDENTITY = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def read_mjcf(root: Element, path: Path) -> RobotModel:
    """Read an MJCF document.

    Raises:
        ModelFileError: The document is broken, has a ball joint, or has elements that only MuJoCo can expand.
    """
    return _MjcfReader(MjcfDocument(root, path)).read()


class _MjcfReader:
    def __init__(self, document: MjcfDocument) -> None:
        self.document = document
        self.links: list[Link] = []
        self.joints: list[Joint] = []
        self.notes = Notes()
        self.names: dict[str, set[str]] = {"body": {"world"}, "joint": set()}
        self.references: dict[str, float] = {}  # position of each joint in the file's initial pose [rad or m]
        self.world_bodies: list[str] = []
        self.inertials: dict[str, Inertial | None] = {}
        self.efforts = self._actuator_efforts()

    def read(self) -> RobotModel:
        document = self.document
        for tag in _UNREADABLE:
            for element in document.root.descendants(tag):
                element.refuse(
                    f"only MuJoCo can expand <{tag}>; load the file in MuJoCo, save it with mujoco.mj_saveLastXML, and "
                    "use the saved file."
                )
        check_count(sum(1 for _ in document.root.descendants("body")), "bodies", document.root)
        for element in document.root.descendants("body"):
            self._claim(element, "body")
        top = self._root_body()
        if list(top.children("joint", "freejoint")):
            self.notes.add(
                "free-root",
                top,
                "the root has a free joint, which is ignored; for a free base, set base='floating' or base='wheeled'",
            )
        if not np.array_equal(document.pose(top), _IDENTITY):
            self.notes.add(
                "root-pose",
                top,
                "a movable base starts at the root pose in the file; a fixed base starts at the pose in the scene",
            )
        self._body(top, None, _IDENTITY, None)
        inertials = compiled_inertials(document.compiler, self.inertials)
        self._mimics()
        passive = self._passive_joints()
        self._note_what_is_left_out()
        return RobotModel(
            name=document.root.get("model") or document.path.stem,
            path=document.path,
            format="mjcf",
            xml=to_text(document.root),
            links=tuple(replace(link, inertial=inertials.get(link.name)) for link in self.links),
            joints=tuple(self.joints),
            notes=tuple(self.notes),
            passive_joints=passive,
            root_pose=pose_from_array(document.pose(top)),
        )

    def _note_what_is_left_out(self) -> None:
        """Add a note for each kind of section that simulators ignore."""
        for section, rule in _LEFT_OUT.items():
            children = list(self.document.children(of=section))
            if not children:
                children = [element for element in self.document.root.children(section) if element.attrib]
            if children:
                self.notes.add(rule, children[0], f"{len(children)} in <{section}>, ignored")
        for option in self.document.root.children("option"):
            physics = [
                f"{name}={option.get(name)}"
                for name in _PHYSICS
                if name in option.attrib and self._unusual(option, name)
            ]
            for flag in option.children("flag"):
                physics += [f"{name}={value}" for name, value in flag.attrib.items() if value == _FLAGS.get(name)]
            if physics:
                self.notes.add("physics-settings", option, f"{', '.join(physics)}: ignored")

    def _unusual(self, option: Element, name: str) -> bool:
        if name == "cone":
            return option.get(name) != _PHYSICS[name]
        return option.numbers(name) != tuple(map(float, _PHYSICS[name].split()))

    def _claim(self, element: Element, kind: str) -> None:
        """Register the name of an element. An unnamed element is assigned a name."""
        name = element.get("name")
        if not name:
            number = 1
            while f"{kind}_{number}" in self.names[kind]:
                number += 1
            name = f"{kind}_{number}"
            element.set("name", name)
            self.notes.add("unnamed", element, f"a {kind} has no name; '{name}' is used")
        elif name in self.names[kind]:
            element.refuse(f"the name '{name}' is already used.")
        self.names[kind].add(name)

    def _root_body(self) -> Element:
        """Return the root link's body. If the world does not contain a suitable body, a new body is created."""
        worlds = list(self.document.root.children("worldbody"))
        self.world_bodies = [body.required("name") for world in worlds for body in world.children("body")]
        if not [body for world in worlds for body in world.descendants("body")]:
            self.document.root.refuse("there is no <body> in <worldbody>.")
        held = [child for world in worlds for child in world.children("body", "frame")]
        if len(held) == 1 and held[0].tag == "body":
            joints = [self.document.with_defaults(j, held[0].get("childclass")) for j in held[0].children("joint")]
            if all(joint.get("type") == "free" for joint in joints):
                return held[0]
        root = Element("body", {"name": "base"} if "base" not in self.names["body"] else {})
        root.file, root.line = worlds[0].file, worlds[0].line
        self._claim(root, "body")
        for world in worlds:
            for child in list(world.children()):
                plane = child.tag == "geom" and child.get("type") in ("plane", "hfield")
                if child.tag in ("body", "frame", "geom", "site") and not plane:
                    world.remove(child)
                    root.append(child)
        worlds[0].append(root)
        waiting = [root]
        while waiting:  # the world's own geoms have no mass in MuJoCo, and are not a part of the robot
            for child in waiting.pop().children("geom", "frame"):
                if child.tag == "geom":
                    child.set("mass", "0")
                else:
                    waiting.append(child)
        return root

    def _body(self, body: Element, parent: str | None, frame: Floats, childclass: str | None) -> None:
        """Read a body, the joints that connect it to its parent (None for the root), and its contents.

        The pose of the body refers to ``frame``, (7,), which is expressed in the parent link.
        """
        name = body.required("name")
        childclass = body.get("childclass") or childclass
        if parent is not None:
            self._connect(body, name, parent, compose(frame, self.document.pose(body)), childclass)
            if body.attrib.pop("mocap", "false") == "true":
                self.notes.add("mocap-body", body, "the mocap body is treated as fixed")
        geoms: list[Geom] = []
        bodies: list[tuple[Element, Floats, str | None]] = []
        self._contents(body, _IDENTITY, childclass, geoms, bodies)
        inertial = self.inertials[name] = body_inertial(self.document, body, geoms)
        self.links.append(body_link(name, geoms))
        if inertial is None and any(math.isnan(geom.mass) for geom in weighed(self.document, geoms)):
            self.notes.add(
                "mesh-mass",
                body,
                "only MuJoCo can compute the mass of the body's shapes, so the default drive gains do not account "
                "for this mass",
            )
        if any(geom.geometry is None and geom.collides for geom in geoms):
            self.notes.add("mujoco-shape", body, "the body has a collision shape that only MuJoCo supports")
        for child, at, inner in bodies:
            self._body(child, name, at, inner)

    def _contents(
        self,
        holder: Element,
        frame: Floats,
        childclass: str | None,
        geoms: list[Geom],
        bodies: list[tuple[Element, Floats, str | None]],
    ) -> None:
        """Collect the contents of a body, including the contents of ``<frame>`` elements, in file order."""
        for child in holder.children():
            if child.tag == "geom":
                geoms.append(read_geom(self.document, self.document.with_defaults(child, childclass), frame))
            elif child.tag == "body":
                bodies.append((child, frame, childclass))
            elif child.tag == "frame":
                inner = compose(frame, self.document.pose(child))
                self._contents(child, inner, child.get("childclass") or childclass, geoms, bodies)
            elif child.tag in ("joint", "freejoint") and holder.tag == "frame":
                child.refuse("joints inside <frame> are not supported; move the joint to the body itself.")

    def _connect(self, body: Element, name: str, parent: str, pose: Floats, childclass: str | None) -> None:
        """Add the joints between a body and its parent.

        Each joint turns about its own anchor in the body. Therefore, the origin of link k is at anchor k, and a fixed
        joint connects the last anchor to the body's origin.
        """
        anchor = np.zeros(3)
        elements = list(body.children("joint", "freejoint"))
        check_count(len(self.links) + len(elements), "links", self.document.root)
        chain = []
        for element in elements:
            self._claim(element, "joint")
            chain.append((element, self.document.with_defaults(element, childclass)))
        off_centre = not chain or any(chain[-1][1].numbers("pos", 3, "0 0 0"))
        for number, (element, joint) in enumerate(chain, start=1):
            last = number == len(chain) and not off_centre
            child = name if last else f"{name}__{number}"
            if not last:
                self.links.append(Link(child))
            at = np.array(joint.numbers("pos", 3, "0 0 0"))
            origin = compose(pose, np.concatenate([at - anchor, [1.0, 0.0, 0.0, 0.0]]))
            self.joints.append(self._joint(element, joint, parent, child, origin))
            parent, pose, anchor = child, _IDENTITY, at
        if off_centre:
            origin = compose(pose, np.concatenate([-anchor, [1.0, 0.0, 0.0, 0.0]]))
            self.joints.append(Joint(f"{name}__fixed", JointType.FIXED, parent, name, pose_from_array(origin)))

    def _joint(self, element: Element, joint: Element, parent: str, child: str, origin: Floats) -> Joint:
        name = element.required("name")
        kind = "free" if element.tag == "freejoint" else joint.get("type", "hinge")
        if kind == "ball":
            element.refuse(
                "ball joints are not supported, because they do not have a single position; use three hinges."
            )
        if kind == "free":
            others = [other for other in self.world_bodies if other != child]
            if child in self.world_bodies and others:
                element.refuse(
                    f"'{child}' can only move freely if it is the only body of <worldbody>; remove {', '.join(others)} "
                    "or the free joint. Define additional objects in the task's scene."
                )
            element.refuse(
                f"'{child}' has a free joint inside the robot; only a body directly in <worldbody> can have a free "
                "joint."
            )
        if kind not in ("hinge", "slide"):
            element.refuse(f"the joint type '{kind}' does not exist; available: hinge, slide, ball, free.")
        axis = np.array(joint.numbers("axis", 3, "0 0 1"))
        length = math.sqrt(float((axis * axis).sum()))
        if length < 1e-9:
            element.refuse("the axis is zero; specify its direction.")
        axis = axis / length
        hinge = kind == "hinge"
        scale = self.document.angle(1.0) if hinge else 1.0
        reference = self.references[name] = joint.number("ref", "0") * scale
        still = np.array([1.0, 0.0, 0.0, 0.0])
        turn = quat_from_axis_angle(axis, -reference) if hinge else still
        origin = compose(origin, np.concatenate([np.zeros(3) if hinge else -reference * axis, turn]))
        lower, upper = self._range(joint, "range", "limited")
        x, y, z = axis.tolist()
        effort = min(self._range(joint, "actuatorfrcrange", "actuatorfrclimited")[1], self.efforts.get(name, math.inf))
        limited = math.isfinite(lower)
        return Joint(
            name=name,
            type=(JointType.REVOLUTE if limited else JointType.CONTINUOUS) if hinge else JointType.PRISMATIC,
            parent=parent,
            child=child,
            origin=pose_from_array(origin),
            axis=(x, y, z),
            limits=JointLimits(lower * scale, upper * scale, effort=effort),
            damping=joint.numbers("damping", default="0")[0],
            friction=joint.number("frictionloss", "0"),
            armature=joint.number("armature", "0"),
        )

    def _range(self, element: Element, attribute: str, flag: str) -> tuple[float, float]:
        """Return a range from the file, or an infinite range if the range is disabled."""
        limited = element.get(flag, "auto")
        if limited == "false" or (limited == "auto" and attribute not in element.attrib):
            return -math.inf, math.inf
        low, high = element.numbers(attribute, 2)
        if limited == "auto" and (low or high) and not self.document.autolimits:
            element.refuse(f'the file sets autolimits="false", so {attribute} also requires {flag}="true" or "false".')
        if low < high:
            return low, high
        text = f'{attribute}="{element.get(attribute)}" is empty'
        if limited != "auto":
            element.refuse(f"{text}.")
        if low or high:  # in MuJoCo, "0 0" means that there is no range
            self.notes.add("no-range", element, f"{text}, so it is not applied")
        return -math.inf, math.inf

    def _actuator_efforts(self) -> dict[str, float]:
        """Return the maximum total effort of the actuators on each joint [N·m or N], which may be infinite."""
        efforts: dict[str, float] = {}
        tendons = {
            tendon.get("name"): {each.required("joint"): abs(each.number("coef")) for each in tendon.children("joint")}
            for tendon in self.document.children("fixed", of="tendon")
        }
        for plain in self.document.children(of="actuator"):
            element = self.document.with_defaults(plain, None, "actuator")
            gear = abs(element.numbers("gear", default="1")[0])
            low, high = self._range(element, "forcerange", "forcelimited")
            if plain.tag == "motor" and math.isinf(high):
                low, high = self._range(element, "ctrlrange", "ctrllimited")
            joint = element.get("joint") or element.get("jointinparent")
            shares = {joint: 1.0} if joint else tendons.get(element.get("tendon"), {})
            if not shares:
                self.notes.add("actuator-lost", plain, "the actuator is ignored, because it does not act on a joint")
            for name, share in shares.items():
                if share * gear > 0.0:
                    efforts[name] = efforts.get(name, 0.0) + share * gear * max(abs(low), abs(high))
        return efforts

    def _passive_joints(self) -> tuple[str, ...]:
        """Return the names of the joints without a drive, and add a note.

        These joints keep their position in the file's initial pose, and this position is redefined as 0. A joint has a
        drive if an actuator acts on the joint itself, on the joint's leader, or on one of the joint's followers.
        """
        if not self.efforts:
            return ()
        leaders = {joint.name: joint.mimic.joint if joint.mimic else joint.name for joint in self.joints}
        driven = {leaders[name] for name in self.efforts if name in leaders}
        passive = [
            joint.name
            for joint in self.joints
            if joint.type is not JointType.FIXED and leaders[joint.name] not in driven
        ]
        for i, joint in enumerate(self.joints):
            if joint.name not in passive:
                continue
            joint = self.joints[i] = replace(joint, mimic=None)  # the engine couples it to another passive joint
            if rest := self.references[joint.name]:
                origin = pose_array(joint.origin)
                turns, axis = joint.type is not JointType.PRISMATIC, np.array(joint.axis)
                pos, quat = (np.zeros(3), quat_from_axis_angle(axis, rest)) if turns else (rest * axis, _IDENTITY[3:])
                lower, upper = joint.limits.lower - rest, joint.limits.upper - rest
                self.joints[i] = replace(
                    joint,
                    origin=pose_from_array(compose(origin, np.concatenate([pos, quat]))),
                    limits=replace(joint.limits, lower=lower, upper=upper),
                )
        if passive:
            text = f"no actuator acts on {', '.join(passive)}, so actions cannot control these joints"
            self.notes.add("passive-joints", self.document.root, text)
        return tuple(passive)

    def _mimics(self) -> None:
        """Convert linear equalities between two joints to mimic joints."""
        places = {joint.name: i for i, joint in enumerate(self.joints)}
        elements: dict[str, Element] = {}
        for plain in self.document.children("joint", of="equality"):
            element = self.document.with_defaults(plain, None, "equality")
            follower, leader = element.required("joint1"), element.get("joint2")
            for name in filter(None, (follower, leader)):
                if name not in places:
                    element.refuse(f"the joint '{name}' does not exist.")
            given = element.numbers("polycoef", default="0 1 0 0 0")
            offset, multiplier, *rest = (*given, *(0.0, 1.0, 0.0, 0.0, 0.0)[len(given) :])  # as in MuJoCo
            if leader is None or any(rest) or element.get("active", "true") != "true":
                text = (
                    f"joint '{follower}' is not treated as a mimic joint, because only the engine evaluates its equality "
                    "constraint"
                )
                self.notes.add("engine-equality", element, text)
                continue
            offset += self.references[follower] - multiplier * self.references[leader]
            elements[follower], i = element, places[follower]
            self.joints[i] = replace(self.joints[i], mimic=Mimic(leader, multiplier, offset))
        self.joints = list(flatten_mimics(self.joints, elements))
        efforts: dict[int, float] = {}
        for joint in self.joints:  # the drive of a leader does the work of all actuators
            if joint.mimic is not None and joint.name in self.efforts:
                moving = self.joints[i := places[joint.mimic.joint]]
                own = moving.limits.effort if moving.name in self.efforts else 0.0
                efforts[i] = efforts.get(i, own) + abs(joint.mimic.multiplier) * joint.limits.effort
        for i, effort in efforts.items():
            self.joints[i] = replace(self.joints[i], limits=replace(self.joints[i].limits, effort=effort))
