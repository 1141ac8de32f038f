"""Arranges the robot sheet: images, joint names, limits and the tool frame."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.description import Robot
from frobs_core.models import RobotModel
from frobs_core.util.errors import MissingDependencyError, ParameterValueError
from frobs_core.util.files import write_aside
from frobs_devkit.robot_sheet.poses import Shot, Shots, choose_shots
from frobs_devkit.robot_sheet.stage import Stage, Tile, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text

WIDTH = 1600  # [pixels]
_MARGIN, _GAP = 28, 12
_HEAD, _TITLE = 96, 30  # [pixels] heights of the headline and of a tile's title
_HOME = (660, 724)  # (height, width) of the tile with the home position
_BESIDE, _ABOVE = (660, 398), (315, 808)  # sizes of the tiles with all joints at their limits, side by side or stacked
_JOINTS = 16  # maximum number of joints that are shown individually
_NAMED = 14  # maximum number of joint names that fit beside an image
_DPI = 100
_INK, _SOFT, _PAPER = "#22262b", "#6b737c", "#ffffff"
_AXES = ("#d62728", "#2ca02c", "#1f77b4")


def draw_robot_sheet(robot: Robot, model: RobotModel, path: Path | str, simulator: str | None = None) -> Path:
    """Draw a robot in its home position and at its joint limits as one PNG image.

    Args:
        robot: Description of the robot, including the home position and the tool.
        model: The parsed model file.
        path: PNG file to write.
        simulator: Name of the simulator to render with. Defaults to the first simulator that can render.

    Returns:
        Path of the PNG file.

    Raises:
        RenderingUnavailableError: This machine cannot render.
        ConfigurationError: matplotlib or a simulator that renders is missing, or the file name has another ending.
        ModelFileError: The simulator cannot build the robot.
    """
    target = Path(path)
    figure_class, canvas_class = png_classes("picture", target)
    shots = choose_shots(model, robot.home, _JOINTS)
    stage = Stage(robot, model, shots.all, simulator)
    layout = _Layout(stage, shots)
    (first, *_), *others = stage.draw(layout.groups)
    sheet = _Sheet(
        figure_class(figsize=(WIDTH / _DPI, layout.height / _DPI), dpi=_DPI, facecolor=_PAPER),
        canvas_class,
        layout.height,
    )
    sheet.headline(model, shots.left_out)
    top = _HEAD + _TITLE
    sheet.tile(first, _MARGIN, top, first.shot.title)
    sheet.names(first, model.joint_names, stage.tcp, _MARGIN, top)
    for tile, (x, y) in zip(others[0] if others else (), layout.limits, strict=True):
        sheet.tile(tile, x, y, tile.shot.title)
    for i, (tile, (x, y)) in enumerate(zip(others[1] if len(others) > 1 else (), layout.joints, strict=True)):
        sheet.tile(tile, x, y, tile.shot.title if i % 2 == 0 else "", tile.shot.caption, 2 * tile.picture.shape[1])
    target.parent.mkdir(parents=True, exist_ok=True)
    write_aside(target, lambda aside: sheet.figure.savefig(aside, format="png", dpi=_DPI))
    return target


def png_classes(option: str, target: Path) -> tuple[type[Figure], type[Any]]:
    """Return matplotlib's classes of figures and of canvases for the PNG file ``target``, which an option names."""
    if target.suffix.lower() != ".png":
        raise ParameterValueError(option, str(target), "a file name that ends in .png")
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError("a picture", ["matplotlib"], "pip install 'frobs-train[plots]'") from error
    return Figure, FigureCanvasAgg


class _Layout:
    """Positions of the tiles: the home position on the left, all limits on the right, and rows of joints below.

    The groups of shots have a common view each. ``limits`` and ``joints`` are the upper left corners (x, y) [pixels] of
    the images with all joints and with a single joint at their limits, and ``height`` is that of the sheet [pixels].
    """

    def __init__(self, stage: Stage, shots: Shots) -> None:
        home, *limits = shots.poses
        pairs = [shot for pair in shots.joints for shot in pair]
        self.groups: list[tuple[Sequence[Shot], View]] = [([home], stage.view([home], _HOME, (0.84, 0.56)))]
        top = _HEAD + _TITLE
        self.limits: list[tuple[int, int]] = []
        self.joints: list[tuple[int, int]] = []
        self.height = top + _HOME[0] + _MARGIN
        if limits:
            views = [stage.view(limits, size, (0.88, 0.88)) for size in (_BESIDE, _ABOVE)]
            view = max(views, key=lambda view: view.scale)
            self.groups.append((limits, view))
            x = _MARGIN + _HOME[1] + _GAP
            beside = [(x, top), (x + _BESIDE[1] + _GAP, top)]
            self.limits = beside if view is views[0] else [(x, top), (x, top + _ABOVE[0] + _TITLE)]
        if pairs:
            columns = 3 if len(shots.joints) <= 6 else 4
            side = (WIDTH - 2 * _MARGIN - (columns - 1) * _GAP) // columns  # combined width of a joint's two images
            size = (side * 9 // 16, side // 2 - 1)
            self.groups.append((pairs, stage.view(pairs, size, (0.9, 0.9))))
            pitch = _TITLE + size[0] + _GAP
            for i in range(len(pairs)):
                row, column = divmod(i // 2, columns)
                x = _MARGIN + column * (side + _GAP) + i % 2 * (size[1] + 2)
                self.joints.append((x, top + _HOME[0] + _GAP + _TITLE + row * pitch))
            self.height += -(-len(shots.joints) // columns) * pitch


class _Sheet:
    """A figure with drawing functions that use pixel coordinates from the top left corner."""

    def __init__(self, figure: Figure, canvas: type[Any], height: int) -> None:
        canvas(figure)  # the canvas registers itself with the figure
        self.figure = figure
        self.height = height

    def text(self, x: float, y: float, text: str, size: float, **style: Any) -> Text:
        """Write text, left-aligned and vertically centered."""
        style = {"color": _INK, "va": "center", "ha": "left", **style}
        return self.figure.text(x / WIDTH, 1.0 - y / self.height, text, fontsize=size, parse_math=False, **style)

    def line(self, points: Sequence[Sequence[float]], color: str, width: float, **style: Any) -> None:
        from matplotlib.lines import Line2D
        from matplotlib.transforms import IdentityTransform

        x, y = np.array(points, float).T
        self.figure.add_artist(
            Line2D(x, self.height - y, color=color, linewidth=width, transform=IdentityTransform(), **style)
        )

    def headline(self, model: RobotModel, left_out: int) -> None:
        """Write the headline, with facts about the robot below it."""
        joints = len(model.joint_names)
        mass = sum(link.inertial.mass for link in model.links if link.inertial)
        facts = f"{joints} actuated joint{'' if joints == 1 else 's'}, {mass:.3g} kg, {model.path.name}"
        if left_out:
            facts += f"; {left_out} of the joints are not shown individually"
        self.text(_MARGIN, 40, model.name, 21, weight="bold")
        self.text(_MARGIN, 74, facts, 11, color=_SOFT)

    def tile(self, tile: Tile, x: int, y: int, title: str, caption: str = "", room: int = WIDTH) -> None:
        """Draw an image with its upper left corner at (x, y), below a title that is at most ``room`` [pixels] wide."""
        h = tile.picture.shape[0]
        self.figure.figimage(tile.picture[::-1], x, self.height - y - h, origin="lower")
        if title:
            text = self.text(x, y - _TITLE / 2, title, 11.5, weight="bold")
            half = len(title) // 2
            while text.get_window_extent().width > room and half > 2:
                half -= 1
                text.set_text(f"{title[:half]}…{title[-half:]}")
        if caption:
            self.text(x + 8, y + h - 14, caption, 10.5, bbox={"fc": _PAPER, "ec": "none", "alpha": 0.8, "pad": 2.5})
        self.axes(tile, x, y)

    def axes(self, tile: Tile, x: int, y: int) -> None:
        origin, *ends = tile.tool + np.array([x, y])
        for end, color in zip(ends, _AXES, strict=True):
            self.line([origin, end], _PAPER, 4.0, alpha=0.75, solid_capstyle="round")
            self.line([origin, end], color, 2.2, solid_capstyle="round")

    def names(self, tile: Tile, joints: Sequence[str], tool: str, x: int, y: int) -> None:
        """Write the joint names at the sides of an image, with a line from each name to its joint."""
        from matplotlib.patheffects import withStroke

        h, w, _ = tile.picture.shape
        labels = [(name, place, _INK) for name, place in zip(joints[:_NAMED], tile.joints, strict=False)]
        labels.append((tool, tile.tool[0], "#b3450b"))
        middle = float(np.median([place[0] for _, place, _ in labels]))
        left = [label for label in labels if label[1][0] <= middle]
        right = [label for label in labels if label[1][0] > middle]
        while len(left) > len(right) + 1:  # the joints of a straight arm are all in one column
            right.append(left.pop(1))
        for side, at, align in ((left, 14.0, "left"), (right, w - 14.0, "right")):
            side.sort(key=lambda label: float(label[1][1]))
            for (name, place, color), row in zip(side, _spread([float(p[1]) for _, p, _ in side], h), strict=True):
                weight = "bold" if name == tool else "normal"
                text = self.text(x + at, y + row, name, 10.5, ha=align, color=color, weight=weight)
                text.set_path_effects([withStroke(linewidth=3.5, foreground=_PAPER, alpha=0.75)])
                width = text.get_window_extent().width + 6.0
                end = at + (width if align == "left" else -width)
                self.line([(x + end, y + row), (x + place[0], y + place[1])], color, 0.9, alpha=0.75)
                self.line([(x + place[0], y + place[1])], color, 0.0, marker="o", markersize=4.5, mec=_PAPER, mew=0.9)


def _spread(rows: Sequence[float], height: int) -> list[float]:
    """Return row positions inside the image that are close to the given positions, but at least one line apart."""
    gap, edge = 26.0, 24.0
    placed: list[float] = []
    for row in rows:
        placed.append(max(row, placed[-1] + gap if placed else edge))
    for i in reversed(range(len(placed))):
        placed[i] = min(placed[i], height - edge - gap * (len(placed) - 1 - i))
    return placed
