"""Policies through which a person acts on the page: with a handle, the keyboard or a gamepad."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Operator, joint_groups
from frobs_core.description import Observation
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import RunError
from frobs_core.util.rotations import quat_multiply
from frobs_view.limbs import Limb, Wish, limb_of
from frobs_view.viewer import BrowserViewer

MOTIONS: Mapping[str, tuple[int, float]] = {
    **{"KeyW": (0, 1.0), "KeyS": (0, -1.0), "KeyA": (1, 1.0), "KeyD": (1, -1.0), "KeyR": (2, 1.0), "KeyF": (2, -1.0)},
    **{"ArrowUp": (0, 1.0), "ArrowDown": (0, -1.0), "ArrowLeft": (1, 1.0), "ArrowRight": (1, -1.0)},
    **{"KeyU": (3, 1.0), "KeyO": (3, -1.0), "KeyI": (4, 1.0), "KeyK": (4, -1.0), "KeyJ": (5, 1.0), "KeyL": (5, -1.0)},
}
"""Element and sign of the motion for each key."""

JOINTS: Mapping[str, int] = {f"Digit{i + 1}": i for i in range(9)}
"""Index of the joint that each key moves. With Shift, the joint moves backwards."""

GRIPPER = "gripper"
COMMANDS: Mapping[str, tuple[str, ...]] = {
    **{"KeyG": (GRIPPER,), "Enter": ("start", "keep"), "Backspace": ("discard",), "KeyT": ("take over",)},
    **{"button0": (GRIPPER,), "button9": ("start", "keep"), "button8": ("discard",), "button3": ("take over",)},
}
"""Commands of each key and each button of a gamepad, of which the one that is offered is chosen."""

_STICKS = np.array([[0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, -1], [0] * 4, [0] * 4, [0, 0, -1, 0]])


class Teleop(Operator):
    """A person who drags a handle at the tool, or at the place to which a wheeled robot drives.

    If the environment is not shown in a browser yet, the policy opens a page and logs its address.
    """

    source: ClassVar[str] = "handle"
    """``"handle"``, ``"keyboard"`` or ``"gamepad"``."""

    keys: ClassVar[frozenset[str]] = frozenset(COMMANDS)
    """Keys and buttons that the policy reads. All other keys keep their meaning on the page."""

    def __init__(self) -> None:
        self._own: BrowserViewer | None = None
        self._offered: tuple[str, ...] = ()
        self._commands: deque[str] = deque()
        self._buttons: list[Any] = []
        self._folder: Any = None
        self._status: Any = None
        self._handle: Any = None
        self._is_dragging = False
        self._dragged: tuple[Floats, Floats] | None = None
        self._opening: float | None = None

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Show the environment in the browser, with a panel and a handle.

        Raises:
            RunError: The environment has several rows, another action space than its controllers, or a controller that
                cannot be teleoperated.
        """
        base: Any = env.unwrapped
        if not hasattr(base, "control"):
            raise RunError("only environments of FRobs can be teleoperated.")
        if base.simulation.num_envs != 1:
            raise RunError(f"a person can act in 1 environment, not in {base.simulation.num_envs}; set num_envs to 1.")
        self._space = base.control.action_space
        if getattr(env, "single_action_space", env.action_space) != self._space:
            raise RunError("an environment whose wrappers change the action cannot be teleoperated; omit the wrappers.")
        self._limbs: list[Limb] = []
        for name, robot in base.control.robots.items():
            groups = joint_groups(robot.robot.robot, robot.robot.model)
            for group, controller in robot.controllers.items():
                joints = robot.robot.group(groups[group], name=group)
                self._limbs.append(limb_of(f"{name}/{group}", controller, joints, base.control_timestep))
        self._main = next((limb for limb in self._limbs if limb.handle), None)
        self._gripper = next((limb for limb in self._limbs if not limb.handle), None)
        if isinstance(base.viewer, BrowserViewer):
            viewer = base.viewer
        else:
            viewer = self._own = BrowserViewer()
            viewer.bind(base)
            base.after_step.append(lambda result: viewer.update())
        self._viewer = viewer
        viewer.server.devices.wanted |= self.keys
        self._folder = viewer.server.gui.add_folder("Teleoperation", order=-0.75)
        if self._gripper is not None:
            self._add_button("open or close the gripper", GRIPPER)
        if self.source == "handle" and self._main is not None:
            self._handle = self._add_handle(self._main)
        self._restart()

    def _add_button(self, label: str, command: str) -> Any:
        with self._folder:
            button = self._viewer.server.gui.add_button(label)
        button.on_click(lambda event: self._choose((command,)))
        return button

    def _add_handle(self, limb: Limb) -> Any:
        handle = self._viewer.server.scene.add_transform_controls(
            "/teleop", scale=limb.handle, disable_rotations=not limb.turns, depth_test=False
        )

        async def drag(event: Any) -> None:  # asynchronous, so that the order of the phases is kept
            self._is_dragging = event.phase != "end"
            self._dragged = np.array(handle.position, float), np.array(handle.wxyz, float)

        handle.on_update(drag)
        return handle

    def _restart(self) -> None:
        """Hold the robot where it is."""
        for limb in self._limbs:
            limb.begin()
        self._opening = self._dragged = None
        if self._handle is not None and self._main is not None:
            self._start = self._main.pose()
            self._handle.position, self._handle.wxyz = self._start[0], (1.0, 0.0, 0.0, 0.0)

    def _choose(self, commands: Sequence[str]) -> None:
        for command in commands:
            if command == GRIPPER or command in self._offered:
                self._commands.append(command)
                return

    def _read(self) -> None:
        """Read the presses of keys and buttons, and toggle the gripper."""
        for press in self._viewer.server.devices.presses():
            self._choose(COMMANDS.get(press, ()))
        while GRIPPER in self._commands:
            self._commands.remove(GRIPPER)
            if self._gripper is not None:
                self._opening = -1.0 if (self._opening or self._gripper.opening()) > 0.0 else 1.0

    def _wish(self) -> Wish:
        """Return the motion that the person commands now."""
        wish, devices = Wish(opening=self._opening), self._viewer.server.devices
        if self.source == "handle":
            if self._dragged is not None:
                pos, turn = self._dragged
                wish.target = pos, quat_multiply(turn, self._start[1])
        elif self.source == "gamepad":
            wish.motion = _STICKS @ devices.axes()
        else:
            keys = devices.keys()
            for key in keys & MOTIONS.keys():
                element, sign = MOTIONS[key]
                wish.motion[element] += sign
            backwards = bool(keys & {"ShiftLeft", "ShiftRight"})
            wish.joints = {JOINTS[key]: -1.0 if backwards else 1.0 for key in keys & JOINTS.keys()}
        return wish

    def act(self, observation: Observation, episode_start: Mask) -> Floats:
        """Return the action of the person, (1, n)."""
        self._read()
        is_alone = not self._viewer.server.has_clients
        if is_alone:
            self._is_dragging = False
        if is_alone or (episode_start[0] and not self._is_dragging):
            self._restart()
        wish, still = self._wish(), Wish()
        moved = (self._main, self._gripper)
        parts = [limb.action(wish if limb in moved else still) for limb in self._limbs]
        return np.concatenate(parts)[None].astype(np.float32)

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return that a person acts."""
        return {"intervention": np.ones(1, np.bool_)}

    @property
    def is_moving(self) -> bool:
        """Whether the handle is dragged, or a key or stick moves the robot."""
        wish = self._wish()
        return self._viewer.server.has_clients and bool(self._is_dragging or wish.motion.any() or wish.joints)

    def offer(self, commands: Sequence[str]) -> None:
        """Show a button for each command, instead of those for other commands. Keys choose the commands, too."""
        self._offered = tuple(commands)
        self._commands.clear()
        for button in self._buttons:
            button.remove()
        self._buttons = [self._add_button(command, command) for command in commands]

    def command(self) -> str:
        """Return the next command, and keep the page alive."""
        self._read()
        self._viewer.update()
        return self._commands.popleft() if self._commands else ""

    def show(self, text: str) -> None:
        """Show a line of text in the panel."""
        if self._status is None:
            with self._folder:
                self._status = self._viewer.server.gui.add_markdown(text, order=-1.0)
        self._status.content = text

    def close(self) -> None:
        """Close the page if the policy has opened it, or remove the panel and the handle from the page."""
        if self._folder is not None:
            self._viewer.server.devices.wanted -= self.keys
            for element in (self._folder, self._handle):
                if element is not None:
                    element.remove()
            self._folder = None
        if self._own is not None:
            self._own.close()


class KeyboardTeleop(Teleop):
    """A person who moves the robot with keys, which the page sends while its window has the focus."""

    source = "keyboard"
    keys = frozenset({*MOTIONS, *JOINTS, *COMMANDS, "ShiftLeft", "ShiftRight"})


class GamepadTeleop(Teleop):
    """A person who moves the robot with the sticks of a gamepad that is connected to the browser."""

    source = "gamepad"
