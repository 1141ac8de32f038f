"""Runs trained policies on a robot with only NumPy and onnxruntime.

    bundle.py        reads, writes and validates bundle files
    manifest.py      parses the part of bundle.json that is required to run a policy
    observation.py   validates observations
    spaces.py        represents spaces without Gymnasium
    graph.py         runs the ONNX graph in onnxruntime
    limits.py        limits actions
    latency.py       measures the duration of actions
    policy.py        combines these modules in the policy class

``python -m frobs_deploy BUNDLE`` prints a summary of a bundle and the latency of its policy on this machine.
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
