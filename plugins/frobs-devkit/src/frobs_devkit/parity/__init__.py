"""Certificates that state how closely simulators agree on a task.

The modules::

    measure.py          the list of measurements and their requirements
    under_test.py       a simulator to compare, and the environment for the comparison
    tolerances.py       all tolerances, with the reason for each
    kinematics.py · step_response.py · gravity_drop.py · replay.py · slip.py · lidar.py · rewards.py · policy.py
                        one measurement each, which returns comparisons and curves of several subjects
    body_experiments.py the measurements of bodies on the floor: settling, friction, sliding and fall
    free_bodies.py      placement of the scene's bodies, and the comparison of their values, for body_experiments.py and
                        slip.py
    certificate.py      all results and files; draw.py draws the images

``import frobs_core`` does not import this package.
"""

from frobs_devkit.parity.actions import ActionFile, read_actions
from frobs_devkit.parity.certificate import Certificate
from frobs_devkit.parity.measure import measure_parity
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, Status
from frobs_devkit.parity.tolerances import TOLERANCES, Tolerance
from frobs_devkit.parity.under_test import Subject, make_subjects

__all__ = [
    "TOLERANCES",
    "ActionFile",
    "Certificate",
    "Comparison",
    "Line",
    "Measurement",
    "Panel",
    "Status",
    "Subject",
    "Tolerance",
    "make_subjects",
    "measure_parity",
    "read_actions",
]
