"""Policy-selection options of ``frobs evaluate`` and ``frobs play``, and a function that opens the selected policy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_core.util.errors import CommandLineError, ConflictingOptionsError

if TYPE_CHECKING:
    from frobs_train import Run

_RUN_OR_ID = (
    "Run folder written by 'frobs train', or bundle written by 'frobs export'. With --model, --pretrained or "
    "--expert: a Gymnasium environment ID."
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

ModelPath = Annotated[
    Path | None,
    typer.Option(
        "--model",
        metavar="FILE",
        show_default=False,
        help="Use this trained model instead of a run. The file must be in the format of the library that trained the "
        "model.",
    ),
]

Pretrained = Annotated[
    bool,
    typer.Option(
        "--pretrained",
        help="Use the trained policy that comes with the environment ID; 'frobs list envs' shows which IDs have one.",
    ),
]

UsesExpert = Annotated[bool, typer.Option("--expert", help="Use the scripted expert of the environment's task.")]

ModelAlgorithm = Annotated[
    str | None,
    typer.Option(
        "--algorithm", metavar="NAME", show_default="read from the file", help="Algorithm of the --model file."
    ),
]

ModelSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        show_default=False,
        help="With --model or --expert: environment setting, such as environment_kwargs.robot=ur5 or "
        "wrappers=[…]. Repeatable.",
    ),
]

Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Also accept a --model file that executes code when it is loaded, and a bundle that refers to files, "
        "modules or wrappers to import. Use this flag only if you trust the author of the file.",
    ),
]


def open_run(
    run: Path,
    model: Path | None,
    algorithm: str | None,
    settings: Sequence[str] | None,
    trust: bool,
    pretrained: bool = False,
    expert: bool = False,
) -> Run:
    """Open a run, a bundle or a model file, or the trained policy or scripted expert of an environment ID.

    Raises:
        ConfigurationError: A flag that requires ``--model`` is used without ``--model``, or a setting is invalid.
        RunError: The folder is not a run folder, or the ID has no trained policy.
        BundleError: The file is not a bundle.
        UntrustedFileError: The bundle requires ``--trust``.
    """
    from frobs_core.plugins.registry import bare_id, pretrained_ids
    from frobs_train import ExpertRun, ModelFile, open_pretrained
    from frobs_train.export.bundle_run import open_run_or_bundle

    chosen = {"--model": model is not None, "--pretrained": pretrained, "--expert": expert}
    if sum(chosen.values()) > 1:
        raise ConflictingOptionsError([flag for flag, given in chosen.items() if given])
    if expert and algorithm is None and not trust:
        return ExpertRun(str(run), settings or ())
    if model is not None:
        return ModelFile(model, str(run), algorithm, settings or (), trust)
    for flag, given in (("--algorithm", algorithm), ("--set", settings), ("--trust", trust and not run.is_file())):
        if given:
            raise CommandLineError(
                flag,
                "this option requires --model FILE; a run stores its own settings, and its folder is always trusted.",
            )
    if pretrained:
        return open_pretrained(str(run))
    if not run.exists() and bare_id(str(run)) in pretrained_ids():
        raise CommandLineError(
            str(run), "this is an environment ID, not a run; add --pretrained to use the ID's trained policy."
        )
    return open_run_or_bundle(run, trust)
