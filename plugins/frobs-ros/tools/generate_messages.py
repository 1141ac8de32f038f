"""Make the Python of the message definitions with Debian's genpy: ``python generate_messages.py [FOLDER]``.

What it makes depends on genpy's runtime alone and is committed, so that a user needs no generator. Run it after a change
of ``src/frobs_ros/messages/definitions``; a test holds the two together.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

MESSAGES = Path(__file__).resolve().parents[1] / "src" / "frobs_ros" / "messages"
PYTHON = "/usr/bin/python3"  # the one that sees Debian's genpy
GENACTION = "/usr/lib/actionlib_msgs/genaction.py"
GENPY = {"msg": "/usr/lib/genpy/genmsg_py.py", "srv": "/usr/lib/genpy/gensrv_py.py"}
SHARE = Path("/usr/share")
FOREIGN = ("std_msgs", "geometry_msgs", "trajectory_msgs", "actionlib_msgs")


def main(target: Path) -> None:
    """Generate every package of the definitions.

    Args:
        target: Folder to write to; files of the same names are replaced.

    Raises:
        subprocess.CalledProcessError: A definition is wrong; genpy has said which.
    """
    packages = sorted(folder for folder in (MESSAGES / "definitions").iterdir() if folder.is_dir())
    with tempfile.TemporaryDirectory() as scratch:
        for package in packages:
            for action in sorted(package.glob("action/*.action")):
                _run(GENACTION, str(action), "-o", f"{scratch}/{package.name}/msg")
        include = [f"-I{name}:{SHARE / name / 'msg'}" for name in FOREIGN]
        include += [f"-I{package.name}:{package / 'msg'}" for package in packages]
        include += [f"-I{package.name}:{scratch}/{package.name}/msg" for package in packages]
        for package in packages:
            made = {
                "msg": [*package.glob("msg/*.msg"), *Path(scratch, package.name).glob("msg/*.msg")],
                "srv": [*package.glob("srv/*.srv")],
            }
            folder = target / package.name
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "__init__.py").write_text("")
            for kind, files in made.items():
                if files:
                    out = str(folder / kind)
                    _run(GENPY[kind], "-p", package.name, "-o", out, *include, *sorted(map(str, files)))
                    _run(GENPY[kind], "--initpy", "-p", package.name, "-o", out)


def _run(*command: str) -> None:
    subprocess.run([PYTHON, *command], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else MESSAGES / "generated")
