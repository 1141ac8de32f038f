"""``frobs export``: write a policy to a single file that runs without the training libraries."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.field_options import option
from frobs_cli.options import CheckpointName, Json
from frobs_cli.output import only_json, print_json, working
from frobs_core.util.errors import ConflictingOptionsError
from frobs_train.cli.opened import Trust


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """Options of ``frobs export``.

    Attributes:
        format: File format of the network in the bundle.
        out: Bundle file to write.
        license: License of the policy: an SPDX identifier such as 'MIT', or a text file.
        page: Folder in which to write a static web page, where physics and policy run in the visitor's browser.
        pretrained: Write the page of the trained policy that comes with an ID.
    """

    format: Literal["onnx"] = option("onnx")
    out: Path | None = option(None, dir_okay=False, show_default="policy.frobs in the run folder")
    checkpoint: CheckpointName = "newest"
    license: str | None = option(None, metavar="SPDX_OR_FILE", show_default="none given")
    page: Path | None = option(None, metavar="FOLDER", file_okay=False, show_default="no page")
    pretrained: bool = option(False)
    trust: Trust = False


def export(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN",
            show_default=False,
            help="Run folder written by 'frobs train'. With --page, also a bundle, or an environment ID with "
            "--pretrained.",
        ),
    ],
    options: ExportOptions,
    json: Json = False,
) -> None:
    """Export the policy of a run as a single file that needs only NumPy and onnxruntime to run.

    The bundle contains the network with all pre- and postprocessing. The bundle also describes the policy's joints,
    units, control rate, observation, limits and origin. The bundle is written only if the exported policy reproduces
    the actions of the trained policy.

    With --page, the command also writes a static web page that needs no server of its own. A visitor can push the robot
    and move the goal.

    Example:
        $ frobs export runs/first
        $ frobs export runs/first --license MIT --out reach.frobs
        $ python -m frobs_deploy reach.frobs
        $ frobs export runs/first --page site
        $ frobs export frobs/PandaPickAndPlace-v0 --pretrained --page site
    """
    from frobs_deploy import Policy, read_bundle
    from frobs_train import Run
    from frobs_train.export.bundle_run import BundleRun, open_pretrained
    from frobs_train.export.export import export as export_run
    from frobs_train.export.pages import find_page_writer

    out, page, pretrained = options.out, options.page, options.pretrained
    if options.trust and (pretrained or run.is_dir()):
        raise CommandLineError(
            "--trust", "this option requires a bundle; run folders and the policies of IDs are always trusted."
        )
    write_page = None if page is None else find_page_writer()
    if pretrained or run.is_file():
        if write_page is None or page is None:
            what = "--pretrained" if pretrained else str(run)
            raise CommandLineError(what, "this policy is exported already; add --page FOLDER to write its page.")
        given = {
            "--out": out,
            "--license": options.license,
            "--checkpoint": None if options.checkpoint == "newest" else options.checkpoint,
        }
        if unused := [flag for flag, value in given.items() if value is not None]:
            raise ConflictingOptionsError(["--pretrained" if pretrained else str(run), *unused])
        with only_json(json), working("writing the page"):
            facts = write_page(
                open_pretrained(str(run)) if pretrained else BundleRun(read_bundle(run), options.trust), page
            )
        _print_page(facts, json)
        return
    with only_json(json), working("exporting"):
        bundle = export_run(Run.open(run), out, checkpoint=options.checkpoint, license=options.license)
        latency = Policy(bundle.path).bench()
        facts = {}
        if write_page is not None and page is not None:
            facts = write_page(BundleRun(read_bundle(bundle.path), trust=True), page)
    if json:
        print_json(
            {
                "bundle": bundle.path,
                "bytes": bundle.path.stat().st_size,
                "format": options.format,
                "export": bundle,
                "latency": latency,
                **({"page": facts} if facts else {}),
            }
        )
        return
    print_facts(
        {
            "name": str(bundle.path),
            "kind": "bundle",
            "size": f"{bundle.path.stat().st_size / 1e3:,.0f} kB",
            "trained": f"{bundle.steps:,} steps",
            "difference": f"at most {bundle.max_difference:.1e} between the actions of the exported and the trained "
            f"policy on {bundle.observations} observations",
            "latency": str(latency),
        }
    )
    if facts:
        _print_page(facts, json)


def _print_page(facts: dict[str, Any], json: bool) -> None:
    if json:
        print_json({"page": facts})
        return
    folder = facts["folder"]
    print_facts(
        {
            "name": str(folder),
            "kind": "static page",
            "size": f"{facts['bytes'] / 1e6:,.1f} MB in {facts['files']} files",
            "try it": f"python -m http.server --directory {folder}",
        }
    )
