"""Prints the doctor's report on a robot, with the findings last so that they remain visible in a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from frobs_cli.output import as_cell, console, print_line, print_title
from frobs_devkit.doctor import Finding, JointFacts, RobotReport, Severity, SimulatorFacts, ToolCandidate
from frobs_models import Gripper

if TYPE_CHECKING:
    from rich.text import Text

_SIGNS = {Severity.ERROR: ("✗", "bold red"), Severity.WARNING: ("!", "bold yellow"), Severity.NOTE: ("·", "dim")}
_TREATMENTS = {"kept": "green", "approximated": "yellow", "dropped": "red", "unknown": "dim"}
_ALIKE = 3  # if there are more findings of one kind, only the first is printed in full
_NAMED = 6  # maximum number of other findings of the same kind that are listed by name
_TOOLS = 6


def print_report(report: RobotReport) -> None:
    """Write a report to stdout."""
    edges = " × ".join(_number(edge) for edge in report.size)
    file, moving = Path(report.file), [joint for joint in report.joints if joint.joint_type != "fixed"]
    print_title(report.name, f"{report.file_format}, {_count(report.dof, 'actuated joint')}")
    print_line()
    _print_grid(
        [
            ["file", str(file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file)],
            ["mass", f"{_number(report.mass)} kg in {_count(len(report.links), 'link')}"],
            ["at home", f"{edges} m (x × y × z)"],
            ["tool", _tool(report.tools)],
            *([["gripper", _gripper(report.gripper)]] if report.gripper else []),
        ]
    )
    if moving:
        _section("joints", "in rad, m, s, N·m and N")
        _print_joints(moving)
    if report.dof:
        _print_drives([joint for joint in report.joints if joint.drive])
    _section("links")
    _print_links(report)
    if len(report.tools) > 1:
        _section("tool candidates", "choose one with tcp=LINK")
        _print_tools(report.tools)
    for simulator in report.simulators:
        _print_simulator(simulator)
    if report.findings:
        _section("findings")
        print_findings(report.findings)
    _print_verdict(report)


def _tool(tools: Sequence[ToolCandidate]) -> str:
    tool = tools[0]
    bound = "" if tool.longest_reach is None else f" (never beyond {_number(tool.longest_reach)} m)"
    return f"{tool.link}; it reaches {_number(tool.reach)} m from the root{bound}"


def _gripper(gripper: Gripper) -> str:
    kind = "one jaw" if gripper.has_one_jaw else "fingers"
    low, high = (f"{1000.0 * width:.0f}" for width in gripper.gap)
    text = f"{kind} moved by {', '.join(gripper.joints)}; opens from {low} to {high} mm"
    return "; ".join([f"{text}, for objects of about {1000.0 * gripper.object_size:.0f} mm", *gripper.notes])


def _print_joints(joints: Iterable[JointFacts]) -> None:
    rows, followers = [], []
    for joint in joints:
        numbers = [_number(value) for value in (joint.lower, joint.upper, joint.velocity, joint.effort, joint.home)]
        rows.append([joint.name, joint.joint_type, _axis(joint.axis) if joint.unit else "–", *numbers])
        if joint.mimic:
            offset = f" {joint.mimic['offset']:+.3g}" if joint.mimic["offset"] else ""
            followers.append([joint.name, f"= {joint.mimic['multiplier']:g} · {joint.mimic['joint']}{offset}"])
    _print_table(["joint", "type", "axis", "lower", "upper", "velocity", "effort", "home"], rows, right=range(3, 8))
    if followers:
        _section("joints that mimic others")
        _print_table(["", ""], followers, header=False)


def _axis(axis: Sequence[float]) -> str:
    """Return a name such as ``"−y"`` if the axis is parallel to a frame axis, otherwise the axis components."""
    for letter, value in zip("xyz", axis, strict=True):
        if abs(abs(value) - 1.0) < 1e-9:
            return letter if value > 0 else f"−{letter}"
    return " ".join(f"{value:.2g}" for value in axis)


def _print_drives(joints: Sequence[JointFacts]) -> None:
    drives = [(joint, joint.drive) for joint in joints if joint.drive is not None]
    _section("drives", "default gains, from each joint's largest inertia")
    rows = []
    for joint, drive in drives:
        numbers = (drive.inertia, drive.stiffness, drive.damping, abs(drive.holding_effort))
        frequency = [_number(drive.bandwidth), f"{1000.0 * drive.time_constant:.3g} ms"]
        rows.append(
            [joint.name, *map(_number, numbers), "–" if joint.effort is None else _number(joint.effort), *frequency]
        )
    heads = ["joint", "inertia", "Kp", "Kd", "holds", "limit", "Hz", "time"]
    _print_table(heads, rows, right=range(1, 8))


def _print_links(report: RobotReport) -> None:
    rows = []
    for link in report.links:
        size = "–" if link.size is None else " × ".join(f"{edge:.3f}" for edge in link.size)
        rows.append(
            [link.name, _number(link.mass), size, *(str(n) if n else "–" for n in (link.visuals, link.collisions))]
        )
    _print_table(["link", "kg", "size in m", "visuals", "collisions"], rows, right=(1, 3, 4))


def _print_tools(tools: Sequence[ToolCandidate]) -> None:
    rows = []
    for tool in tools[:_TOOLS]:
        why = [word for word, holds in (("chosen", tool.chosen), ("tool name", tool.usual_name)) if holds]
        reach = [_number(tool.reach), _number(tool.longest_reach)]
        rows.append([tool.link, str(tool.actuated_joints), *reach, ", ".join(why)])
    _print_table(["link", "joints", "reach in m", "at most", ""], rows, right=(1, 2, 3))
    if len(tools) > _TOOLS:
        print_line(f"    … and {len(tools) - _TOOLS} more; --json lists all")


def _print_simulator(simulator: SimulatorFacts) -> None:
    from rich.text import Text

    _section(simulator.name, f"{simulator.distribution} {simulator.version}")
    if simulator.builds is None:
        verdict, style = "not checked, for the reason in the findings", "dim"
    elif not simulator.builds:
        verdict, style = f"cannot simulate the robot: {simulator.reason}", "bold red"
    elif simulator.overlaps:
        verdict, style = (
            f"simulates the robot; {_count(len(simulator.overlaps), 'pair')} of links overlap in the home position",
            "yellow",
        )
    else:
        free = "" if simulator.overlaps is None else "; no links overlap in the home position"
        verdict, style = f"simulates the robot{free}", "green"
    _print_grid([[Text(verdict, style=style)]], indent=4)
    if simulator.elements:
        rows: list[list[str | Text]] = [
            [
                row.element.replace("_", " "),
                str(len(row.names)),
                Text(row.treatment, _TREATMENTS[row.treatment]),
                row.how,
            ]
            for row in sorted(simulator.elements, key=lambda row: list(_TREATMENTS).index(row.treatment))
        ]
        _print_table(["in the file", "", "", ""], rows, right=(1,), header=False)


def print_findings(findings: Sequence[Finding]) -> None:
    """Write findings to stdout.

    If there are many findings of one kind, only the first finding is printed in full, followed by the names of the
    other affected objects.
    """
    kinds: dict[tuple[Severity, str], list[Finding]] = {}
    for finding in findings:
        kinds.setdefault((finding.severity, finding.code), []).append(finding)
    for alike in kinds.values():
        shown = alike if len(alike) <= _ALIKE else alike[:1]
        for finding in shown:
            last = finding is shown[-1]
            others = [other.about for other in alike[len(shown) :]] if last else []
            _print_finding(finding, others, advise=last or finding.advice != shown[-1].advice)


def _print_finding(finding: Finding, others: Sequence[str], *, advise: bool) -> None:
    from rich.text import Text

    sign, style = _SIGNS[finding.severity]
    line = f" (line {finding.line})" if finding.line else ""
    lines: list[str | Text] = [Text.assemble((finding.about, "cyan"), (line, "dim"), f": {finding.problem}")]
    if others:
        names = list(dict.fromkeys(others))
        more = f", … and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        lines.append(Text(f"likewise {', '.join(names[:_NAMED])}{more}", style="dim"))
    if finding.advice and advise:
        lines.append(Text.assemble(("→ ", "green"), finding.advice))
    _print_grid([[Text(sign if i == 0 else "", style=style), text] for i, text in enumerate(lines)], indent=4)


def _print_verdict(report: RobotReport) -> None:
    from rich.text import Text

    counts = {s: sum(finding.severity is s for finding in report.findings) for s in Severity}
    words = [_count(counts[s], str(s)) for s in Severity if counts[s]]
    said = f": {', '.join(words)}" if words else "; no findings"
    text = "this robot can be used" if report.usable else "this robot cannot be used"
    tried = [simulator for simulator in report.simulators if simulator.builds is not None]
    if report.usable and not all(simulator.complete for simulator in tried):
        words_for = (
            ("on", [s.name for s in tried if s.complete]),
            ("with limits on", [s.name for s in tried if s.builds and not s.complete]),
            ("but not on", [s.name for s in tried if not s.builds]),
        )
        text += " " + ", ".join(f"{word} {' and '.join(names)}" for word, names in words_for if names)
    print_line()
    style = "bold green" if report.usable else "bold red"
    console().print(Text(f"{'✓' if report.usable else '✗'} {text}{said}", style=style), soft_wrap=True)


def _section(title: str, detail: str = "") -> None:
    print_line()
    print_title(f"  {title}", detail)


def _print_grid(rows: Sequence[Sequence[str | Text]], *, indent: int = 2) -> None:
    """Write rows without column headings, and wrap the last column."""
    _print_table([""] * len(rows[0]), rows, header=False, indent=indent)


def _print_table(
    heads: Sequence[str],
    rows: Sequence[Sequence[str | Text]],
    *,
    right: Iterable[int] = (),
    header: bool = True,
    indent: int = 4,
) -> None:
    """Write a table that fits the width of the terminal, and wrap text but not numbers.

    ``right`` contains the indices of the right-aligned columns, and ``indent`` is a number of characters.
    """
    from rich.padding import Padding
    from rich.table import Table

    numbers = set(right)
    table = Table(box=None, show_header=header, header_style="dim", padding=(0, 2, 0, 0), pad_edge=False)
    for i, head in enumerate(heads):
        table.add_column(
            head,
            justify="right" if i in numbers else "left",
            no_wrap=i in numbers or (i > 0 and header and head != "axis"),
            overflow="fold",
            style="cyan" if i == 0 and len(heads) > 2 else None,
        )
    for row in rows:
        table.add_row(*map(as_cell, row))
    out, padded = console(), Padding(table, (0, 0, 0, indent), expand=False)
    if out.is_terminal:
        out.print(padded)
        return
    with out.capture() as captured:  # avoids trailing blanks in files
        out.print(padded)
    for line in captured.get().splitlines():
        out.print(line.rstrip(), soft_wrap=True)


def _number(value: float | None) -> str:
    if value is None:
        return "–"
    text = f"{value:,.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"
    return text.replace("-", "−")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
