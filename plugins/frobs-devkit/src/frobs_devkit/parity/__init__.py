"""The certificate that a task means the same on another simulator.

The modules::

    measure.py          which measurements there are, and what each needs
    subject.py          a simulator that is compared, and what it is compared on
    tolerances.py       every tolerance, with its reason
    kinematics.py · step_response.py · gravity_drop.py · replay.py · settling.py · friction.py · sliding.py · fall.py · slip.py · lidar.py ·
    rewards.py · policy.py
                        one measurement each: from subjects to numbers that are judged, and curves
    free_bodies.py      how sliding.py, fall.py and slip.py place the bodies of the task's scene
    certificate.py      all of it, and its files; report.py writes the Markdown, draw.py the pictures

Imported by those who compare, never by ``import frobs_core``.
"""

from frobs_devkit.parity.actions import ActionFile, read_actions
from frobs_devkit.parity.certificate import Certificate
from frobs_devkit.parity.measure import measure_parity
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, Status
from frobs_devkit.parity.subject import Subject, make_subjects
from frobs_devkit.parity.tolerances import TOLERANCES, Tolerance

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
