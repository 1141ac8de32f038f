"""``frobs check``: the conformance kit."""

from __future__ import annotations

import time
from typing import Any

import typer

from frobs_core.cli.catalogue import find_spec
from frobs_core.cli.options import EnvId, Json
from frobs_core.cli.output import console, only_json, print_json


def check(env_id: EnvId, json: Json = False) -> None:
    """Check that an environment keeps the contract: spaces, seeds, resets, vector against single.

    Exits with 1 where a check fails.

    Example:
        $ frobs check frobs/Irb120Reach-v0
        $ frobs check CartPole-v1 --json
    """
    from rich.text import Text

    from frobs_core.testing import check_env

    spec = find_spec(env_id)
    results: list[dict[str, Any]] = []
    out = console()
    with only_json(json):
        for item in check_env(spec.id):
            start = time.perf_counter()
            try:
                item.run()
                cause = ""
            except Exception as error:  # whatever a check raises is its finding
                cause = f"{type(error).__name__}: {error}" if not isinstance(error, AssertionError) else str(error)
            passed = not cause
            results.append(
                {"name": item.name, "passed": passed, "cause": cause, "seconds": time.perf_counter() - start}
            )
            if not json:
                sign = ("✓ ", "green") if passed else ("✗ ", "bold red")
                out.print(Text.assemble(sign, item.name), soft_wrap=True)
                if cause:
                    out.print(Text(f"    {cause}", style="red"), soft_wrap=not out.is_terminal)
    failed = sum(not result["passed"] for result in results)
    if json:
        print_json({"id": spec.id, "passed": not failed, "checks": results})
    else:
        verdict = f"{failed} of {len(results)} checks failed" if failed else f"all {len(results)} checks passed"
        out.print(f"{spec.id}: {verdict}", style="bold red" if failed else "bold green")
    if failed:
        raise typer.Exit(1)
