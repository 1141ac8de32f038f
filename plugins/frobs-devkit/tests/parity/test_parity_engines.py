"""The engines that are installed beside MuJoCo, against it, on what they claim to do exactly."""

from __future__ import annotations

import pytest

from frobs_core import plugins
from frobs_devkit.parity import Status, measure_parity

ID = "frobs/Irb120Reach-v0"
EXACT = ["forward_kinematics", "step_response", "saturated_step_response", "gravity_drop", "replay"]
OTHERS = [name for name, record in plugins.records("simulator").items() if name != "mujoco" and not record.is_paced]


@pytest.mark.parametrize(
    "simulator",
    [
        pytest.param(name, marks=[pytest.mark.slow, pytest.mark.needs("gazebo")]) if name == "gazebo" else name
        for name in OTHERS
    ],
)
def test_free_motion_is_the_same_motion(simulator: str) -> None:
    certificate = measure_parity(ID, ["mujoco", simulator], only=EXACT)
    over = [
        f"{measurement.name}: {c.quantity} {c.error:.2g} {c.where} {c.reason}"
        for measurement in certificate.measurements
        for c in measurement.comparisons
        if c.status is Status.FAILED
    ]
    assert over == []
