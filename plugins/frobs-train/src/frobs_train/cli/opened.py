"""Policy-selection options of ``frobs evaluate`` and ``frobs play``, and a function that opens the selected policy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.completion import complete_policy
from frobs_cli.errors import CommandLineError
from frobs_core.util.errors import ConflictingOptionsError

if TYPE_CHECKING:
    from frobs_train import Run

_RUN_OR_ID = (
    "Run folder written by 'frobs train', or bundle written by 'frobs export'. With --policy, --pretrained, --expert or "
    "--model: a Gymnasium environment ID."
)

RunOrId = Annotated[Path, typer.Argument(metavar="RUN", show_default=False, help=_RUN_OR_ID)]

RunsOrIds = Annotated[
    list[Path],
    typer.Argument(
        metavar="RUN...",
        show_default=False,
        help=f"{_RUN_OR_ID} If you specify several policies, one table lists all results.",
    ),
]

PolicyName = Annotated[
    str | None,
    typer.Option(
        "--policy",
        metavar="NAME",
        show_default=False,
        help="Policy that acts in the environment: a name from 'frobs list policies', or the path of a run folder, "
        "bundle or model file.",
        autocompletion=complete_policy,
    ),
]

ModelPath = Annotated[
    Path | None,
    typer.Option(
        "--model",
        metavar="FILE",
        show_default=False,
        help="Short form of --policy for a model file, in the format of the library that trained the model.",
    ),
]

Pretrained = Annotated[
    bool,
    typer.Option(
        "--pretrained",
        help="Short form of --policy pretrained: the trained policy that comes with the environment ID; 'frobs list envs' "
        "shows which IDs have one.",
    ),
]

UsesExpert = Annotated[
    bool,
    typer.Option("--expert", help="Short form of --policy expert: the scripted expert of the environment's task."),
]

ModelAlgorithm = Annotated[
    str | None,
    typer.Option("--algorithm", metavar="NAME", show_default="read from the file", help="Algorithm of the model file."),
]

ModelSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        show_default=False,
        help="For a policy without settings of its own: environment setting, such as environment_kwargs.robot=ur5 or "
        "wrappers=[…]. Repeatable.",
    ),
]

Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Also accept a model file that executes code when it is loaded, and a bundle that refers to files, "
        "modules or wrappers to import. Use this flag only if you trust the author of the file.",
    ),
]


def open_run(
    run: Path,
    policy: str | None,
    model: Path | None = None,
    algorithm: str | None = None,
    settings: Sequence[str] | None = None,
    trust: bool = False,
) -> Run:
    """Open what the arguments of a command name. For arguments and errors, see :func:`frobs_train.open_policy`."""
    from frobs_core.plugins.registry import bare_id, environments
    from frobs_train import ModelFile, open_policy

    if model is not None:
        return ModelFile(model, str(run), algorithm, settings or (), trust)
    if policy is None:
        for flag, value in (("--algorithm", algorithm), ("--set", settings), ("--trust", trust and not run.is_file())):
            if value:
                raise CommandLineError(
                    flag,
                    "this option requires --model FILE or --policy; a run stores its own settings, and its folder is "
                    "always trusted.",
                )
        if not run.exists() and bare_id(str(run)) in environments():
            raise CommandLineError(
                str(run),
                "this is an environment ID, not a run; add --pretrained to use the ID's trained policy, or another "
                "--policy from 'frobs list policies'.",
            )
    return open_policy(run, policy, settings=settings or (), algorithm=algorithm, trust=trust)


def policy_name(policy: str | None, model: Path | None, pretrained: bool, expert: bool) -> str | None:
    """Return the name of the policy that ``--policy`` or one of its short forms selects, or None.

    Raises:
        ConflictingOptionsError: Several of these options are used.
    """
    options = {
        "--policy": policy is not None,
        "--model": model is not None,
        "--pretrained": pretrained,
        "--expert": expert,
    }
    if sum(options.values()) > 1:
        raise ConflictingOptionsError([flag for flag, is_used in options.items() if is_used])
    return "pretrained" if pretrained else "expert" if expert else policy
