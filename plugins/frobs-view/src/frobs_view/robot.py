"""The page of a robot file: joint sliders, masses and inertias, and findings at the links that they concern."""

from __future__ import annotations

import queue
import re
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.kernel.drawn import drawn_robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Inertial, JointType, RobotModel, home_positions, inertia_matrix, link_poses
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_from_matrix, quat_multiply, quat_rotate
from frobs_devkit.doctor import Finding, RobotReport, examine_robot
from frobs_view.drawing import Drawing
from frobs_view.server import ViewServer
from frobs_view.viewer import RATE

_ABOUT = re.compile(r"^(link|joint) '(.*)'$")
_COLORS = {"error": (200, 30, 40), "warning": (230, 130, 20), "note": (60, 110, 200)}
_MASS_RGB = (90, 60, 200)


class RobotPage:
    """A page with a robot that people can move.

    Args:
        robot: Model file, robot file, or name of a robot.
        server: Server of the page.

    Attributes:
        model: Model of the robot.
        report: What ``frobs doctor robot`` reports.
        joint_positions: Positions of the joints, (dof,) [rad or m].

    Raises:
        ModelFileError: The file cannot be read.
    """

    def __init__(self, robot: str, server: ViewServer) -> None:
        described = RobotConfig(robot=robot).describe()
        self.model: RobotModel = described.read_model()
        self.report: RobotReport = examine_robot(robot, simulators=plugins.engines())
        self.joint_positions = np.array(home_positions(self.model, described.home))
        self._home = self.joint_positions.copy()
        self._server = server
        self._events: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        names = [f"robot/{link.name}" for link in self.model.links]
        self._drawing = Drawing(server.scene, names, list(drawn_robot("robot", self.model)))
        self._index = {link.name: i for i, link in enumerate(self.model.links)}
        self._masses: list[Any] = []
        server.scene.add_grid("/floor", width=2.0, height=2.0, plane="xy", cell_size=0.1, section_size=0.5)
        size = max(0.3, *self.report.size)
        server.initial_camera.position = (size, -size, size)
        server.initial_camera.look_at = (0.0, 0.0, 0.4 * size)
        self._add_panel(server.gui)
        self._move()

    def _add_panel(self, gui: Any) -> None:
        self._sliders = []
        with gui.add_folder("Joints"):
            for i, joint in enumerate(self.model.actuated_joints):
                low, high = _range(joint)
                home = min(max(float(self._home[i]), low), high)
                unit = "m" if joint.type is JointType.PRISMATIC else "rad"
                step = (high - low) / 500.0 or 1e-3
                label = f"{joint.name} [{unit}]"
                slider = gui.add_slider(label, min=low, max=high, step=step, initial_value=home)
                slider.on_update(self._queued(self._read_sliders))
                self._sliders.append(slider)
            gui.add_button("home").on_click(self._queued(lambda: self.move(self._home)))
        with gui.add_folder("View"):
            for label, switch in (
                ("frames", self._drawing.show_frames),
                ("collision shapes", self._drawing.show_collisions),
                ("masses and inertias", self._show_masses),
            ):
                self._add_toggle(gui, label, switch)
        with gui.add_folder("Masses", expand_by_default=False):
            gui.add_markdown(_mass_table(self.report))
        with gui.add_folder("Findings"):
            gui.add_markdown("\n".join(map(_line, self.report.findings)) or "No findings.")
        self._mark_findings()

    def _add_toggle(self, gui: Any, label: str, switch: Callable[[bool], object]) -> None:
        box = gui.add_checkbox(label, initial_value=False)
        box.on_update(self._queued(lambda: switch(bool(box.value))))

    def _queued(self, function: Callable[[], object]) -> Callable[[Any], None]:
        return lambda event: self._events.put(function)

    def _mark_findings(self) -> None:
        """Show the codes of the findings at the links that they concern, in the color of the most severe one."""
        above = {joint.name: joint.child for joint in self.model.joints}
        marks: dict[str, list[Finding]] = {}
        for finding in self.report.findings:
            match = _ABOUT.match(finding.about)
            link = match and (match[2] if match[1] == "link" else above.get(match[2]))
            if link in self._index:
                marks.setdefault(link, []).append(finding)
        for link, findings in marks.items():
            name = f"/frame{self._index[link]}/findings"
            codes = dict.fromkeys(f"{finding.severity}: {finding.code}" for finding in findings)
            self._server.scene.add_label(name, ", ".join(codes))
            severities = {str(finding.severity) for finding in findings}
            color = next(_COLORS[severity] for severity in _COLORS if severity in severities)
            self._server.scene.add_icosphere(f"{name}/dot", radius=0.012, color=color, cast_shadow=False)

    def _show_masses(self, visible: bool) -> None:
        """Show a box with the mass and the inertia of each link at its center of mass."""
        if visible and not self._masses:
            for link in self.model.links:
                if link.inertial is not None and link.inertial.mass > 0.0:
                    self._masses += self._add_mass(self._index[link.name], link.inertial)
        for node in self._masses:
            node.visible = visible

    def _add_mass(self, frame: int, inertial: Inertial) -> list[Any]:
        edges, quat = equivalent_box(inertial)
        place: dict[str, Any] = {"position": inertial.origin.pos, "wxyz": quat}
        scene, name = self._server.scene, f"/frame{frame}/mass"
        box = scene.add_box(name, color=_MASS_RGB, dimensions=edges, opacity=0.45, cast_shadow=False, **place)
        return [box, scene.add_label(f"{name}/label", f"{inertial.mass:.3g} kg")]

    def _read_sliders(self) -> None:
        self.joint_positions = np.array([slider.value for slider in self._sliders], float)
        self._move()

    def move(self, joint_positions: Floats) -> None:
        """Show the robot at other joint positions.

        Args:
            joint_positions: (dof,) [rad or m]
        """
        for slider, position in zip(self._sliders, joint_positions.tolist(), strict=True):
            slider.value = position
        self.joint_positions = joint_positions.copy()
        self._move()

    def _move(self) -> None:
        pos, quat = link_poses(self.model, self.joint_positions[None])
        root = self.model.root_pose
        turn = np.array(root.quat_wxyz)
        self._drawing.update(np.array(root.pos) + quat_rotate(turn, pos[0]), quat_multiply(turn, quat[0]))

    def poll(self) -> None:
        """Do what people asked for on the page."""
        while not self._events.empty():
            self._events.get_nowait()()

    def run(self, is_running: Callable[[], bool] = lambda: True) -> None:
        """Serve the page until ``is_running`` returns False."""
        while is_running():
            self.poll()
            time.sleep(1.0 / RATE)


def equivalent_box(inertial: Inertial) -> tuple[tuple[float, float, float], Floats]:
    """Return the edges [m] and the orientation (4,) of the solid box that has the mass and inertia of a link."""
    moments, axes = np.linalg.eigh(inertia_matrix(inertial))  # ascending
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    squares = 6.0 * (moments.sum() - 2.0 * moments) / inertial.mass
    x, y, z = np.sqrt(np.maximum(squares, 1e-6)).tolist()
    return (x, y, z), quat_from_matrix(axes)


def _range(joint: Any) -> tuple[float, float]:
    """Return the range of a slider [rad or m], which is finite even if the joint has no limits."""
    low, high = joint.limits.lower, joint.limits.upper
    wide = 1.0 if joint.type is JointType.PRISMATIC else float(np.pi)
    return (low if np.isfinite(low) else -wide), (high if np.isfinite(high) else wide)


def _mass_table(report: RobotReport) -> str:
    rows = ["| link | mass [kg] | moments [kg·m²] |", "|---|---|---|"]
    for link in report.links:
        if link.mass is not None:
            moments = " ".join(f"{each:.2g}" for each in link.principal_moments or ())
            rows.append(f"| {_plain(link.name)} | {link.mass:.4g} | {moments} |")
    return "\n".join([*rows, f"| all | {report.mass:.4g} | |"])


def _line(finding: Finding) -> str:
    advice = f" To fix it: {finding.advice}." if finding.advice else ""
    return "- " + _plain(f"{finding.severity}: {finding.about}: {finding.problem}.{advice}")


def _plain(text: str) -> str:
    """Return text of a file with all characters escaped that have a meaning in Markdown or HTML."""
    return re.sub(r"([\\`*_{}\[\]()<>#+!|~:&-])", r"\\\1", text.replace("\n", " "))
