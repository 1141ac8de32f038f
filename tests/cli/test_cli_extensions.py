"""Commands of other distributions, on a real dist-info: each command line in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

WAVE = '''
"""Waves."""
import typer

def wave(context: typer.Context) -> None:
    """Wave in some way.

    Example:
        $ frobs wave
    """
    if context.invoked_subcommand is None:
        typer.echo("waves")

def twice(name: str = typer.Argument(help="Whom.")) -> None:
    """Wave twice.

    Example:
        $ frobs wave twice you
    """
    typer.echo(f"waves at {name}, twice")

def tide() -> None:
    """Examine the tide.

    Example:
        $ frobs doctor tide
    """
    typer.echo("low")

def list_() -> None:
    """Take a word that is taken.

    Example:
        $ frobs list
    """

COMMANDS = {"twice": twice}
'''


@pytest.fixture
def extended(tmp_path: Path, process: Run) -> Run:
    """Run a command beside a distribution that adds some, of which one is broken."""
    (tmp_path / "acme_wave.py").write_text(WAVE)
    info = tmp_path / "acme_wave-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-wave\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[frobs.commands]\nwave = acme_wave\ndoctor.tide = acme_wave:tide\nlist = acme_wave:list_\n"
        "sink = acme_wave:gone\nnowhere.at.all = acme_wave:tide\n"
    )
    path = os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH", ""))))
    return lambda *args: process(*args, env={**os.environ, "PYTHONPATH": path})


def test_a_distribution_adds_commands_families_and_examinations(extended: Run) -> None:
    done = extended("wave")
    assert done.stdout == "waves\n", done.stderr
    assert extended("wave", "twice", "you").stdout == "waves at you, twice\n"
    assert extended("doctor", "tide").stdout == "low\n"
    told = extended("--help").stdout
    assert "From plugins" in told
    assert "Wave in some way." in told


def test_a_word_that_is_taken_stays_what_it_was(extended: Run) -> None:
    assert "mujoco" in extended("list", "simulators").stdout


def test_a_command_that_cannot_be_imported_hurts_no_other(extended: Run) -> None:
    done = extended("sink", "--deep", "2")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "'sink' of acme-wave could not be imported: AttributeError" in done.stderr
    assert extended("--version").returncode == 0


def test_a_command_that_is_not_installed_says_what_installs_it(process: Run) -> None:
    code = "from frobs_core.cli import extensions; extensions.entry_points = lambda group: []; import frobs_core.cli as c; c.main()"
    done = subprocess.run([sys.executable, "-c", code, "ros"], text=True, capture_output=True)
    assert done.returncode == 2
    assert "no command is named 'ros'." in done.stderr
    assert "pip install frobs-ros" in done.stderr
