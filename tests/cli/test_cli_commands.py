"""Commands of other distributions, on a real dist-info: each command line in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

COMMANDS = """
from frobs_cli.commands import Command

COMMANDS = (
    Command(name="wave", summary="Wave in some way."),
    Command(name="wave twice", summary="Wave twice.", function="acme_wave:twice"),
    Command(name="doctor tide", summary="Examine the tide.", function="acme_wave:tide"),
    Command(name="list", summary="Take a word that is taken.", function="acme_wave:tide"),
    Command(name="sink", summary="Sink.", function="acme_wave:gone"),
    Command(name="nowhere at all", summary="Wave in no group.", function="acme_wave:tide"),
)
"""

WAVE = '''
import typer

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
'''


@pytest.fixture
def extended(tmp_path: Path, process: Run) -> Run:
    """Run a command beside a distribution that adds some, of which one is broken, and one with a broken table."""
    (tmp_path / "acme_wave.py").write_text(WAVE)
    (tmp_path / "acme_wave_commands.py").write_text(COMMANDS)
    for name, target in (("wave", "acme_wave_commands:COMMANDS"), ("wreck", "acme_wreck:COMMANDS")):
        info = tmp_path / f"acme_{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: acme-{name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[frobs.commands]\n{name} = {target}\n")
    path = os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH", ""))))
    return lambda *args, **env: process(*args, env={**os.environ, "PYTHONPATH": path, **env})


TYPER = """
import sys, typer
sys.argv = ["two", "--help"]
app = typer.Typer()
app.command("one")(lambda: None)
app.command("two")(lambda: None)
app()
"""
"""A program of two commands that prints its help."""

FROBS = "import sys, frobs_cli; sys.argv = ['frobs', *{arguments}]; sys.stdout = sys.__stdout__; frobs_cli.main()"


END = """
import atexit, resource, sys
def report():
    used = resource.getrusage(resource.RUSAGE_SELF)
    sys.stderr.write(str(used.ru_utime + used.ru_stime))
atexit.register(report)
"""


def cpu_seconds(code: str, **env: str) -> float:
    """Return the CPU time of a process [s], its start included."""
    command = [sys.executable, "-c", END + code]
    return float(subprocess.run(command, capture_output=True, text=True, env={**os.environ, **env}).stderr)


def test_a_distribution_adds_commands_groups_and_members_of_groups(extended: Run) -> None:
    done = extended("wave")
    assert "Wave twice." in done.stdout, done.stderr
    assert extended("wave", "twice", "you").stdout == "waves at you, twice\n"
    assert extended("doctor", "tide").stdout == "low\n"
    help_text = extended("--help").stdout
    assert "From plugins" in help_text
    assert "Wave in some way." in help_text


def test_a_taken_name_keeps_its_command(extended: Run) -> None:
    assert "mujoco" in extended("list", "simulators").stdout


def test_a_command_that_cannot_be_imported_hurts_no_other(extended: Run) -> None:
    done = extended("sink")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "'sink' could not be imported from 'acme_wave:gone': AttributeError" in done.stderr
    assert extended("--version").returncode == 0


def test_a_table_that_cannot_be_read_is_reported_in_the_help(extended: Run) -> None:
    done = extended("--help")
    assert done.returncode == 0
    assert "the commands of acme-wreck could not be read: ModuleNotFoundError" in done.stderr


def test_a_command_that_is_not_installed_says_what_installs_it() -> None:
    code = "from frobs_cli import commands as c; c.entry_points = lambda group: []; import frobs_cli; frobs_cli.main()"
    done = subprocess.run([sys.executable, "-c", code, "ros"], text=True, capture_output=True)
    assert done.returncode == 2
    assert "no command is named 'ros'." in done.stderr
    assert "pip install -e" in done.stderr
    assert "plugins/frobs-ros" in done.stderr


def test_help_and_completion_import_nothing_heavy(process: Run) -> None:
    code = (
        "import sys, atexit, frobs_cli; sys.argv = ['frobs', *sys.argv[1:]]\n"
        "atexit.register(lambda: print(*sorted({'numpy', 'gymnasium', 'torch', 'xacro'} & set(sys.modules)), file=sys.stderr))\n"
        "frobs_cli.main()"
    )
    completing = {"_FROBS_COMPLETE": "complete_bash", "COMP_WORDS": "frobs train frobs/Irb", "COMP_CWORD": "2"}
    for args, env in ((["--help"], {}), ([], completing)):
        done = subprocess.run(
            [sys.executable, "-c", code, *args], capture_output=True, text=True, env={**os.environ, **env}
        )
        assert done.stderr == "\n"
        assert "frobs/Irb120Reach-v0" in done.stdout


@pytest.mark.slow
def test_help_and_completion_cost_little_more_than_typer_itself() -> None:
    completing = {"_FROBS_COMPLETE": "complete_bash", "COMP_WORDS": "frobs train frobs/Irb", "COMP_CWORD": "2"}
    asked = {
        "typer": (TYPER, {}),
        "help": (FROBS.format(arguments=["--help"]), {}),
        "complete": (FROBS.format(arguments=[]), completing),
    }
    # Other processes make the same code cost more CPU time. So the least of several runs in turn is compared.
    runs = [{name: cpu_seconds(code, **env) for name, (code, env) in asked.items()} for _ in range(10)]
    least = {name: min(run[name] for run in runs) for name in asked}
    assert least["help"] <= 1.8 * least["typer"]
    assert least["complete"] <= 2.3 * least["typer"]
