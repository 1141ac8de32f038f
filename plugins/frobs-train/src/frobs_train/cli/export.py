"""``frobs export``: write a policy to a single file that runs without the training libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from frobs_cli.facts import print_facts
from frobs_cli.options import CheckpointName, Json, RunFolder
from frobs_cli.output import only_json, print_json, working


def export(
    run: RunFolder,
    format: Annotated[Literal["onnx"], typer.Option(help="File format of the network in the bundle.")] = "onnx",
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", dir_okay=False, show_default="policy.frobs in the run folder", help="Bundle file to write."
        ),
    ] = None,
    checkpoint: CheckpointName = "newest",
    license: Annotated[
        str | None,
        typer.Option(
            metavar="SPDX_OR_FILE",
            show_default="none given",
            help="License of the policy: an SPDX identifier such as 'MIT', or a text file.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Export the policy of a run as a single file that needs only NumPy and onnxruntime to run.

    The bundle contains the network with all pre- and postprocessing. The bundle also describes the policy's joints,
    units, control rate, observation, limits and origin. The bundle is written only if the exported policy reproduces
    the actions of the trained policy.

    Example:
        $ frobs export runs/first
        $ frobs export runs/first --license MIT --out reach.frobs
        $ python -m frobs_deploy reach.frobs
    """
    from frobs_deploy import Policy
    from frobs_train import Run
    from frobs_train.export.export import export as export_run

    with only_json(json), working("exporting"):
        bundle = export_run(Run.open(run), out, checkpoint=checkpoint, license=license)
        latency = Policy(bundle.path).bench()
    if json:
        print_json(
            {
                "bundle": bundle.path,
                "bytes": bundle.path.stat().st_size,
                "format": format,
                "export": bundle,
                "latency": latency,
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
