"""Runs trained policies on a robot with only NumPy and onnxruntime.

    bundle.py        reading, writing and validating the bundle file
    manifest.py      the part of bundle.json that is required to run a policy
    observation.py   validated observations of a policy
    spaces.py        spaces without Gymnasium
    graph.py         the ONNX graph in onnxruntime
    limits.py        limits on actions
    latency.py       duration of actions
    policy.py        the policy, which combines all of them

``python -m frobs_deploy BUNDLE`` prints what a bundle is for and how fast it runs on this machine.
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
