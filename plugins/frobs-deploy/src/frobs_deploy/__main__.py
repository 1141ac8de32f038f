"""Print a summary of a policy bundle and the latency of the policy on this machine."""

from __future__ import annotations

import argparse
import re
import sys

from frobs_deploy.errors import DeployError
from frobs_deploy.policy import Policy

_UNPRINTABLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\xad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff\U000e0000-\U000e007f]"
)


def main() -> int:
    """Write a summary to stdout, and return the exit code, which is 2 if the bundle cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m frobs_deploy", description=__doc__)
    parser.add_argument("bundle", metavar="BUNDLE", help="file that 'frobs export' wrote")
    parser.add_argument(
        "--bench", metavar="N", type=int, default=1000, help="number of actions to measure (default: 1000)"
    )
    arguments = parser.parse_args()
    try:
        policy = Policy(arguments.bundle)
        latency = policy.bench(max(1, arguments.bench))
    except DeployError as error:
        sys.stderr.write(f"error: {_one_line(error)}\n")
        return 2
    manifest, said = policy.manifest, policy.bundle.manifest
    lines = {
        "environment": said.get("environment", {}).get("id"),
        "robot": (said.get("robot") or {}).get("name"),
        "joints": ", ".join(manifest.joint_names),
        "controller": (said.get("controller") or {}).get("name"),
        "control_timestep": None if manifest.control_timestep is None else f"{manifest.control_timestep:g} s",
        "observation": ", ".join(manifest.terms or (key for key in manifest.observation if key)),
        "images": "; ".join(_image(policy, key) for key in manifest.images),
        "recurrent": "yes" if policy.recurrent else None,
        "license": said.get("license") or "none given",
        "latency": latency,
    }
    width = max(map(len, lines))
    sys.stdout.writelines(f"{name:{width}}  {_one_line(value)}\n" for name, value in lines.items() if value)
    return 0


def _one_line(value: object) -> str:
    """Return a text without control characters, which could control the terminal."""
    return _UNPRINTABLE.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), str(value))


def _image(policy: Policy, key: str) -> str:
    image, space = policy.manifest.images[key], policy.manifest.observation[key]
    height, width, channels = space.shape
    values = f"{space.low.min():g} to {space.high.max():g}" + (f" {image.unit}" if image.unit != "1" else "")
    drawn = ", with the task's markers drawn" if image.markers else ""
    return (
        f"{key} from camera '{image.camera}', {image.modality}, {height} × {width} × {channels} {space.dtype}, "
        f"{values}{drawn}"
    )


if __name__ == "__main__":
    sys.exit(main())
