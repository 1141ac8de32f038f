"""Running trained policies with NumPy and onnxruntime alone: what goes onto a robot.

    bundle.py        the file: reading, writing, refusing what is damaged
    manifest.py      what bundle.json says, as far as running needs it
    observation.py   what a policy is given, checked
    spaces.py        spaces without Gymnasium, and what fits into them
    graph.py         the ONNX graph in onnxruntime
    limits.py        what an action is clipped to
    latency.py       how long actions take
    policy.py        all of it together

``python -m frobs_deploy BUNDLE`` says what a bundle is for and how fast it runs here.
"""

from frobs_deploy.bundle import Bundle, pack_bundle, parse_bundle, read_bundle
from frobs_deploy.errors import (
    BundleError,
    BundleMismatchError,
    DeployError,
    OnnxruntimeMissingError,
    PolicyArgumentError,
)
from frobs_deploy.latency import Latency
from frobs_deploy.manifest import Image, Manifest, read_manifest
from frobs_deploy.policy import Policy
from frobs_deploy.spaces import space_to_json

__all__ = [
    "Bundle",
    "BundleError",
    "BundleMismatchError",
    "DeployError",
    "Image",
    "Latency",
    "Manifest",
    "OnnxruntimeMissingError",
    "Policy",
    "PolicyArgumentError",
    "pack_bundle",
    "parse_bundle",
    "read_bundle",
    "read_manifest",
    "space_to_json",
]
