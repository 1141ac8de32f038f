"""``frobs parity ID ID …``: certifies several environments as jobs, and prints one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from frobs_cli.output import only_json, print_json, print_table
from frobs_train import Job, Progress, Runner, raise_failures
from frobs_train.cli.jobs_progress import collect_outcomes, short_path

_MEMORY = 2 * 2**30  # [B] for Python and the engines


def certification_job(environment: str, simulators: Sequence[str], folder: Path, **keywords: Any) -> Job:
    """Return a job that writes an environment's certificate.

    The job's result is a mapping with ``folder`` and the entries of :meth:`frobs_devkit.parity.Certificate.to_dict`.

    Args:
        environment: Gymnasium ID.
        simulators: Names of the simulators, starting with the reference.
        folder: Folder of the certificate.
        keywords: Additional keyword arguments of :func:`frobs_devkit.parity.measure_parity`.
    """
    return Job(
        name=environment,
        function=f"{__name__}:certify",
        arguments={
            "environment": environment,
            "simulators": tuple(simulators),
            "folder": folder.absolute(),
            "keywords": keywords,
        },
        memory=_MEMORY,
    )


def certify(
    environment: str,
    simulators: Sequence[str],
    folder: Path,
    keywords: Mapping[str, Any],
    report: Callable[[Progress], bool | None],
) -> dict[str, Any]:
    """Measure how closely simulators agree on an environment, and write the certificate."""
    from frobs_devkit.parity import measure_parity

    certificate = measure_parity(environment, simulators, **keywords)
    certificate.write(folder)
    return {"folder": folder, **certificate.to_dict()}


def certify_and_report(jobs: Sequence[Job], runner: Runner, folder: Path, *, json: bool) -> bool:
    """Certify several environments, print one row per environment, and return whether all of them passed.

    Args:
        jobs: Jobs created by :func:`certification_job`.
        runner: Runner that executes the jobs.
        folder: Existing folder that will contain the folder of each certificate.
        json: Whether to write JSON, and nothing else, to stdout.
    """
    with only_json(json):
        outcomes = collect_outcomes(
            [job.name for job in jobs],
            lambda update: runner.run(jobs, folder, update),
            f"the finished certificates are in {folder}",
        )
    done = [outcome.result for outcome in outcomes if outcome.error is None]
    if json:
        print_json(done)
    elif done:
        print_table(["environment", "", "comparisons", "over the tolerance", "certificate"], [_row(it) for it in done])
    raise_failures(outcomes)
    return all(it["passed"] for it in done)


def _row(found: Mapping[str, Any]) -> list[str]:
    failed = [
        measurement["title"].lower() for measurement in found["measurements"] if measurement["status"] == "failed"
    ]
    sign = "✓" if found["passed"] else "✗"
    return [found["id"], sign, found["verdict"], ", ".join(failed) or "–", short_path(found["folder"])]
