"""The wheel and the sdist of each distribution, and the files about the project beside them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

sys.path.insert(0, str(Path(__file__).parents[1] / ".ci"))
sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from layers import Distribution, distributions
from package_checks import metadata, problems

ROOT = Path(__file__).parents[1]
PYTHON = "Programming Language :: Python :: 3."


def build(folder: Path, out: Path) -> tuple[Path, Path]:
    """Return a new wheel and a new sdist, built without pip."""
    wheel = next(WheelBuilder(str(folder)).build(directory=str(out), versions=["standard"]))
    sdist = next(SdistBuilder(str(folder)).build(directory=str(out), versions=["standard"]))
    return Path(wheel), Path(sdist)


@pytest.fixture(params=distributions(), name="distribution")
def each_distribution(request: pytest.FixtureRequest) -> Distribution:
    return distributions()[request.param]


def test_an_index_would_accept_the_distribution(distribution: Distribution, tmp_path: Path) -> None:
    assert problems(*build(distribution.folder, tmp_path)) == []


def test_metadata_agree_with_those_of_the_core(distribution: Distribution) -> None:
    core = distributions()["frobs-core"].project
    for key in ("license", "license-files", "authors", "urls"):
        assert distribution.project.get(key) == core.get(key), key
    on_robots = distribution.name in ("frobs-deploy", "frobs-ros2")  # ROS 2 Humble has Python 3.10
    assert distribution.project["requires-python"] == (">=3.10" if on_robots else core["requires-python"])
    engine_has_wheels_for_one = distribution.name == "frobs-sim-pybullet"
    usual = {line for line in core["classifiers"] if not line.startswith(PYTHON) or not engine_has_wheels_for_one}
    assert usual - {"Typing :: Typed"} <= set(distribution.project["classifiers"])
    assert set(core["keywords"][:2]) <= set(distribution.project["keywords"])


def test_the_classifiers_name_the_pythons_that_wheels_are_tried_on() -> None:
    code = (ROOT / ".ci" / "wheels.py").read_text("utf-8")
    tried = re.findall(r'"(3\.\d+)"', re.search(r"^PYTHONS = (.*)$", code, re.MULTILINE)[1])
    classifiers = distributions()["frobs-core"].project["classifiers"]
    assert [f"Programming Language :: Python :: {version}" for version in tried] == [
        line for line in classifiers if re.search(r":: 3\.\d+$", line)
    ]


def test_the_checks_find_what_an_index_would_refuse(tmp_path: Path) -> None:
    folder = tmp_path / "project"
    (folder / "frobs_bad").mkdir(parents=True)
    (folder / "frobs_bad" / "__init__.py").write_text("")
    (folder / "notes.txt").write_text("not for users")
    (folder / "README.md").write_text("# frobs-bad\n[more](../docs/more.md)\n")
    (folder / "pyproject.toml").write_text(
        '[build-system]\nrequires = ["hatchling"]\nbuild-backend = "hatchling.build"\n'
        '[project]\nname = "frobs-bad"\nversion = "0.2.0"\nreadme = "README.md"\n'
        'dependencies = ["frobs-core>=0.1"]\nclassifiers = ["License :: OSI Approved :: MIT License"]\n'
    )
    found = "\n".join(problems(*build(folder, tmp_path)))
    for expected in (
        "license file is missing",
        "license MIT",
        "must not repeat the license",
        "the author must be",
        "keywords are missing",
        "relative links",
        "'../docs/more.md'",
        "bounds must be",
        "py.typed is missing",
        "foreign files: ['frobs_bad', 'notes.txt']",
    ):
        assert expected in found


def test_the_sdist_of_the_devkit_contains_the_templates(tmp_path: Path) -> None:
    import tarfile

    wheel, sdist = build(distributions()["frobs-devkit"].folder, tmp_path)
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path / "unpacked", **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    again = next(
        WheelBuilder(str(next((tmp_path / "unpacked").iterdir()))).build(
            directory=str(tmp_path / "again"), versions=["standard"]
        )
    )
    names = zipfile.ZipFile(wheel).namelist()
    assert "frobs_devkit/scaffold/files/cookiecutter/cookiecutter.json" in names
    assert sorted(zipfile.ZipFile(again).namelist()) == sorted(names)


def test_the_version_is_stated_the_same_everywhere(tmp_path: Path) -> None:
    wheel, _ = build(distributions()["frobs"].folder, tmp_path)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert str(citation["version"]) == metadata(wheel)["Version"]


def test_the_citation_has_what_its_format_requires() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["message"]
    assert citation["title"] == "FRobs"
    assert citation["authors"] == [{"name": "The FRobs authors"}]
    assert citation["license"] == "MIT"
    assert set(citation) <= {
        *("abstract", "authors", "cff-version", "keywords", "license", "message", "title", "type", "version")
    }


@pytest.mark.parametrize(
    "form", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")), ids=lambda path: path.stem
)
def test_issue_forms_have_what_their_format_requires(form: Path) -> None:
    content = yaml.safe_load(form.read_text("utf-8"))
    assert content["name"]
    assert content["description"]
    fields = [element for element in content["body"] if element["type"] != "markdown"]
    assert len({element["id"] for element in fields}) == len(fields) > 0
    assert all(element["type"] in ("input", "textarea", "dropdown") for element in fields)
    assert all(element["attributes"]["label"] for element in fields)


def test_the_image_copies_what_is_there() -> None:
    lines = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", " ").splitlines()
    ignored = (ROOT / ".dockerignore").read_text("utf-8").split()
    copied = [source for line in lines if line.startswith("COPY") for source in line.split()[1:-1] if source[0] != "-"]
    assert copied
    assert [source for source in copied if not (ROOT / source).exists()] == []
    assert [source for source in copied if source.rstrip("/") in ignored] == []
    instructions = [line.split()[0] for line in lines if line and line[0] not in "# "]
    assert set(instructions) <= {"FROM", "RUN", "COPY", "ENV", "USER", "WORKDIR", "CMD", "ARG"}
    assert next(line for line in reversed(lines) if line.startswith("USER ")) != "USER root"


def test_the_image_and_the_development_container_install_pytorch_first() -> None:
    image = (ROOT / "Dockerfile").read_text("utf-8")
    pinned = next(
        line for line in (ROOT / "constraints.txt").read_text("utf-8").splitlines() if line.startswith("torch==")
    )
    assert 0 < image.index(pinned) < image.index("plugins/")
    container = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text("utf-8"))
    assert (ROOT / ".devcontainer" / container["build"]["dockerfile"]).resolve() == ROOT / "Dockerfile"
    assert (ROOT / ".devcontainer" / container["build"]["context"]).resolve() == ROOT


def test_the_conda_environment_installs_every_distribution() -> None:
    content = yaml.safe_load((ROOT / "environment.yml").read_text("utf-8"))
    pip = next(line["pip"] for line in content["dependencies"] if isinstance(line, dict))
    folders = {ROOT / line.removeprefix("--editable ") for line in pip if line.startswith("--editable ")}
    assert folders == {distribution.folder for distribution in distributions().values()}
    assert "--constraint constraints.txt" in pip


def test_make_wheels_describes_its_options() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "wheels.py", "--help"], text=True, capture_output=True, check=True
    )
    assert "--require-all" in done.stdout
