"""Arguments of ``frobs evaluate`` and ``frobs play``, which select a policy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.completion import complete_policy
from frobs_cli.errors import CommandLineError
from frobs_cli.field_options import option
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

ModelSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        show_default=False,
        help="Environment setting, such as environment_kwargs.robot=ur5 or wrappers=[…]. A trained policy stores its own "
        "settings, of which only environment_kwargs.simulator_kwargs can be set. Repeatable.",
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


@dataclass(frozen=True, kw_only=True)
class PolicyChoice:
    """A policy, as chosen on the command line.

    Attributes:
        policy: Policy that acts in the environment: a name from 'frobs list policies', or the path of a run folder,
            bundle or model file.
        pretrained: Short form of --policy pretrained: the trained policy that comes with the environment ID; 'frobs
            list envs' shows which IDs have one.
        expert: Short form of --policy expert: the scripted expert of the environment's task.
        model: Short form of --policy for a model file, in the format of the library that trained the model.
        algorithm: Algorithm of the model file.
    """

    policy: str | None = option(None, autocompletion=complete_policy)
    pretrained: bool = option(False)
    expert: bool = option(False)
    model: Path | None = option(None)
    algorithm: str | None = option(None, show_default="read from the file")
    settings: ModelSettings = None
    trust: Trust = False

    @property
    def name(self) -> str | None:
        """The name of the policy that ``--policy`` or one of its short forms selects, or None."""
        flags = ("policy", "model", "pretrained", "expert")
        used = [f"--{flag}" for flag in flags if getattr(self, flag) not in (None, False)]
        if len(used) > 1:
            raise ConflictingOptionsError(used)
        return "pretrained" if self.pretrained else "expert" if self.expert else self.policy

    def open(self, run: Path) -> Run:
        """Open what the arguments of a command name. For errors, see :func:`frobs_train.open_policy`."""
        from frobs_core.plugins.registry import bare_id, environments
        from frobs_train import ModelFile, open_policy

        name = self.name  # raises an error if there are several
        if self.model is not None:
            return ModelFile(self.model, str(run), self.algorithm, self.settings or (), self.trust)
        if name is None:
            unused = {
                "--algorithm": self.algorithm,
                "--trust": self.trust and not run.is_file(),
            }
            for flag, value in unused.items():
                if value:
                    raise CommandLineError(
                        flag,
                        "this option requires --model FILE or --policy; the algorithm of a run is known, and its folder is "
                        "always trusted.",
                    )
            if not run.exists() and bare_id(str(run)) in environments():
                raise CommandLineError(
                    str(run),
                    "this is an environment ID, not a run; add --pretrained to use the ID's trained policy, or another "
                    "--policy from 'frobs list policies'.",
                )
        return open_policy(run, name, settings=self.settings or (), algorithm=self.algorithm, trust=self.trust)
