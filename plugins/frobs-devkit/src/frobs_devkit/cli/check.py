"""``frobs check``: the conformance kit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.completion import complete_id
from frobs_cli.errors import CommandLineError
from frobs_cli.field_options import option
from frobs_cli.options import Json
from frobs_cli.output import console, only_json, print_json

if TYPE_CHECKING:
    from frobs_devkit.testing import Report, Result, Subject

_SIGNS = {
    "passed": ("✓", "green"),
    "failed": ("✗", "bold red"),
    "expected_failure": ("✗", "yellow"),
    "skipped": ("–", "yellow"),
    "inconclusive": ("○", "yellow"),
    "not_applicable": ("–", "dim"),
}


@dataclass(frozen=True, kw_only=True)
class CheckOptions:
    """Options of ``frobs check``.

    Attributes:
        robot: Robot to use for checks of controllers, tasks and environments.
        simulator: Simulator in which to run the checks.
        expect_failure: Name of a check that is expected to fail, and the reason. If this check passes, it is reported
            as failed. Repeatable.
        settings: Setting in the same form as for 'frobs train': algorithm_config.KEY for an algorithm,
            environment_kwargs.KEY for an environment or task, environment_kwargs.controller_kwargs.KEY for a
            controller, environment_kwargs.sensors.NAME.KEY for a sensor type. Repeatable.
        steps: Number of environment steps in the short training run that checks an algorithm.
    """

    robot: str | None = option(None, show_default="the robot of ID_OR_PLUGIN, or a small test robot")
    simulator: str | None = option(
        None, show_default="the simulator of ID_OR_PLUGIN; for a robot, all installed simulators"
    )
    expect_failure: Sequence[str] = option((), metavar="CHECK=REASON")
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")
    steps: int | None = option(None, min=1, show_default="300")


def check(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="ID_OR_PLUGIN",
            show_default=False,
            help="What to check: a Gymnasium environment ID, a part ('robot:irb120' or 'irb120'), an extension "
            "('sensor_type:lidar', 'capability:rays', 'parameter:mass' or 'command:train'), or a plugin or distribution "
            "with everything that it provides.",
            autocompletion=complete_id,
        ),
    ],
    options: CheckOptions,
    json: Json = False,
) -> None:
    """Check that an environment, a part or a plugin fulfills its contract.

    A check is inconclusive (○) if it ran but did not exercise the behavior that it tests, for example because no
    episode ended or nothing moved. At the end, the command lists the simulator capabilities that were verified, and the
    versions of the tested packages. Exits with status 1 if any check failed (✗).

    Example:
        $ frobs check frobs/Irb120Reach-v0
        $ frobs check simulator:mujoco
        $ frobs check frobs-robots-abb --simulator mujoco
        $ frobs check algorithm:sac --set algorithm_config.learning_starts=50 --steps 500
        $ frobs check CartPole-v1 --json
    """
    with only_json(json):
        from frobs_core.plugins.registry import find_spec
        from frobs_core.util.yaml import merge
        from frobs_devkit.testing import find_subject, run_checks
        from frobs_train import read_setting

        item = find_subject(subject)
        if item.kind == "environment":
            find_spec(item.name)
        expected = dict(_reason(text) for text in options.expect_failure)
        given = _settings_of(item, merge(*(read_setting(setting) for setting in options.settings)))
        checks = item.checks(options.robot, options.simulator, given, options.steps)
        report = run_checks(checks, None if json else _print_result, expected)
    if json:
        print_json({"id": item.name, "kind": item.kind, "claimed_capabilities": item.claims, **report.as_dict()})
    else:
        _print_end(item, report)
    if not report.ok:
        raise typer.Exit(1)


def _settings_of(subject: Subject, given: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings that concern the subject. They have the same dotted keys as in a run configuration."""
    path = {
        "algorithm": ("algorithm_config",),
        "environment": ("environment_kwargs",),
        "task": ("environment_kwargs",),
        "controller": ("environment_kwargs", "controller_kwargs"),
        "sensor_type": ("environment_kwargs", "sensors", subject.name),
    }.get(subject.kind, ())
    for depth, section in enumerate(path):
        for key in given:
            if key != section:
                right = ".".join((*path, key))
                raise CommandLineError(
                    f"--set {'.'.join((*path[:depth], key))}",
                    f"the settings for checks of a {subject.kind.replace('_', ' ')} are in {'.'.join(path)}; write "
                    f"--set {right}=VALUE.",
                )
        inner = given.get(section, {})
        if not isinstance(inner, Mapping):
            raise CommandLineError(f"--set {section}", f"is {inner!r}; write --set {'.'.join(path)}.KEY=VALUE.")
        given = inner
    return given


def _reason(given: str) -> tuple[str, str]:
    name, sign, reason = given.partition("=")
    if not (sign and name.strip() and reason.strip()):
        raise CommandLineError("--expect-failure", f"expected CHECK=REASON, got '{given}'.")
    return name.strip(), reason.strip()


def _print_result(result: Result) -> None:
    from rich.text import Text

    out = console()
    sign, style = _SIGNS[result.status]
    name = result.name if "." in result.name else result.name.replace("_", " ")
    out.print(Text.assemble((f"{sign} ", style), name, (f"  {result.seconds:.1f} s", "dim")), soft_wrap=True)
    if result.message:
        for line in Text(result.message, style=style).wrap(out, max(out.width - 4, 20)):
            out.print(Text.assemble("    ", line), soft_wrap=True)


def _print_end(subject: Subject, report: Report) -> None:
    from rich.text import Text

    out = console()
    if report.inconclusive:
        names = ", ".join(result.name for result in report.inconclusive)
        out.print(
            Text(
                f"warning: some checks were inconclusive because the situation they test did not occur: {names}",
                style="yellow",
            ),
            soft_wrap=True,
        )
    verified = [f"{name} ({subject.claims[name]})" if name in subject.claims else name
                for name in report.verified_capabilities]  # fmt: skip
    unverified = [name for name in subject.claims if name not in report.verified_capabilities]
    for words, listed in (("verified", verified), ("claimed, not verified", unverified)):
        if listed:
            out.print(Text(f"{words}: {', '.join(listed)}", style="dim"), soft_wrap=True)
    ran_on = ", ".join(f"{name} {version}" for name, version in report.versions.items())
    out.print(Text(f"on {ran_on}", style="dim"), soft_wrap=True)
    counts = {status: sum(result.status == status for result in report.results) for status in _SIGNS}
    verdict = ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts.items() if count)
    out.print(verdict, style="bold green" if report.ok else "bold red", soft_wrap=True)
