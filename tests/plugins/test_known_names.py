from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.collection import known
from frobs_core.plugins.registry import find_spec
from frobs_core.util.errors import UnknownNameError

ROOT = Path(__file__).parents[2]


def test_known_names_are_those_of_the_distributions_of_this_repository():
    known_names = runpy.run_path(str(ROOT / ".ci" / "known_names.py"))["known_names"]
    assert known() == known_names(), "run: python .ci/known_names.py"


@pytest.mark.parametrize("look_up", [registry.find_environment, find_spec])
def test_an_id_that_is_not_installed_says_what_to_install(site, look_up, monkeypatch):
    monkeypatch.setattr("gymnasium.registry", {})
    with (
        plugins.isolated(site.plugins()),
        pytest.raises(UnknownNameError, match=r"To install it: pip install -e .*plugins/frobs-tasks-navigation"),
    ):
        look_up("frobs/KobukiMaze-v0")


def test_a_command_in_a_family_that_is_not_installed_says_what_to_install():
    import typer

    from frobs_cli.group import FrobsGroup

    root = typer.Context(FrobsGroup(name="frobs"), info_name="frobs")
    family = FrobsGroup(name="doctor")
    with pytest.raises(UnknownNameError, match=r"To install it: pip install -e .*plugins/frobs-ros"):
        family.resolve_command(typer.Context(family, info_name="doctor", parent=root), ["ros"])
