"""Reads the results that ``frobs evaluate`` stored in a run folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from frobs_core.util.budgets import BUDGETS
from frobs_core.util.errors import RunError
from frobs_core.util.files import read_json

_Count = Annotated[int, Field(ge=0, le=2**63)]
_Share = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]


class _Octant(BaseModel):
    success_rate: _Share


class _EvaluationFile(BaseModel):
    """The fields that FRobs reads. Newer versions may add more."""

    model_config = ConfigDict(strict=True)

    steps: _Count
    episodes: Annotated[_Count, Field(ge=1)]
    seed: Annotated[int, Field(ge=0)] | None = None
    mean_reward: FiniteFloat
    success_rate: _Share | None = None
    success_interval: Annotated[list[_Share], Field(min_length=2, max_length=2)] | None = None
    steps_to_success: Annotated[FiniteFloat, Field(ge=0.0)] | None = None
    success_by_octant: dict[str, _Octant] | None = None
    simulator: str | None = None
    simulator_kwargs: dict[str, Any] | None = None
    randomize: dict[str, Any] | None = None
    deterministic: bool = True


def is_as_trained(result: Mapping[str, Any]) -> bool:
    """Return whether an evaluation used deterministic actions, the training run's simulator and the nominal models."""
    changed = result.get("simulator") or result.get("randomize") or result.get("simulator_kwargs") is not None
    return not changed and bool(result.get("deterministic", True))


def list_evaluations(run: Path) -> list[Path]:
    """Return the evaluation files of a run folder, ordered by file name."""
    files = sorted((run / "evaluations").glob("*.json"))
    limit = BUDGETS["run folder"]["evaluations"]
    if len(files) > limit:
        raise RunError(f"{run / 'evaluations'} contains {len(files):,} files; the limit is {limit:,}.")
    return files


def read_evaluation(path: Path) -> dict[str, Any]:
    """Return the content of an evaluation file."""
    try:
        content = read_json(path)
        _EvaluationFile.model_validate(content)
    except OSError as error:
        raise RunError(f"{path} cannot be read: {error.strerror}.") from error
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise RunError(f"{path} is damaged: {f'{where}: ' if where else ''}{first['msg']}.") from error
    return content
