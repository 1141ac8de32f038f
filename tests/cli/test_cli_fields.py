import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
import typer
from typer.testing import CliRunner

from frobs_cli.field_options import option, with_options
from frobs_cli.lazy_names import lazy_names


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a command.

    Attributes:
        hidden: A field that is no option.
        count: Number of apples, on
            two lines with ``code``.
        file: A file.
        words: Words. Repeatable.
        color: Color of the apples.
        fast: Whether to hurry.
    """

    hidden: int = 7
    count: int = option(3, min=1)
    file: Path | str | None = option(None, name="input", show_default="none given")
    words: Sequence[str] = option((), name="set", metavar="WORD")
    color: Literal["red", "green"] = option("red")
    fast: bool = option(False)
    size: Annotated[float, typer.Option(help="Size in meters.")] = 0.5


def run(*args: str) -> tuple[Any, str]:
    seen: list[Any] = []

    def command(settings: Settings, json: Annotated[bool, typer.Option("--json", help="JSON.")] = False) -> None:
        seen.append((settings, json))

    command.__annotations__ = {"settings": Settings, "json": Annotated[bool, typer.Option("--json", help="JSON.")]}
    app = typer.Typer(add_completion=False)
    app.command()(with_options(command))
    result = CliRunner().invoke(app, args, env={"COLUMNS": "200", "NO_COLOR": "1"})
    return seen[0] if seen else result.exit_code, result.output


def test_omitted_options_keep_the_defaults_of_the_dataclass() -> None:
    assert run()[0] == (Settings(), False)


def test_options_become_the_fields_of_the_dataclass() -> None:
    args = [
        "--count",
        "5",
        "--input",
        "x.yaml",
        "--set",
        "a",
        "--set",
        "b",
        "--color",
        "green",
        "--fast",
        "--size",
        "2",
        "--json",
    ]
    settings = Settings(count=5, file=Path("x.yaml"), words=["a", "b"], color="green", fast=True, size=2.0)
    assert run(*args)[0] == (settings, True)


def test_the_help_of_an_option_is_the_docstring_of_the_field() -> None:
    output = run("--help")[1]
    for text in ("Number of apples, on two lines with code.", "(none given)", "red|green", "Size in meters.", "JSON."):
        assert text in output
    assert "hidden" not in output
    assert "--no-fast" not in output


def test_an_option_outside_of_its_bounds_is_rejected() -> None:
    assert run("--count", "0")[0] == 2


def test_lazy_names_are_those_that_the_package_imports_for_type_checkers(tmp_path: Path) -> None:
    (tmp_path / "lazy_package").mkdir()
    (tmp_path / "lazy_package" / "one.py").write_text("print('imported'); Thing = 3\n")
    (tmp_path / "lazy_package" / "__init__.py").write_text(
        "from typing import TYPE_CHECKING\nfrom frobs_cli.lazy_names import lazy_names\nif TYPE_CHECKING:\n"
        "    from lazy_package.one import Thing as Thing\n__all__, __getattr__ = lazy_names(__name__, __file__)\n"
    )
    code = "import lazy_package; print(lazy_package.__all__); from lazy_package import Thing; print(Thing)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.splitlines() == ["['Thing']", "imported", "3"], done.stderr


def test_an_unknown_lazy_name_is_an_attribute_error() -> None:
    import frobs_train

    _, find = lazy_names("frobs_train", str(frobs_train.__file__))
    with pytest.raises(AttributeError, match="module 'frobs_train' has no attribute 'nothing'"):
        find("nothing")
