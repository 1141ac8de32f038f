"""Measure the certificate in the documentation again: ``python docs/certificate.py RUN [SIMULATOR…]``.

RUN is a run of frobs/Irb120Reach-v0. Writes ``docs/how-to/parity-measured.md`` and its picture in about two minutes. The
published page uses the run that ``frobs train frobs/Irb120Reach-v0 --controller tcp_delta_position --steps 60_000 --seed 0
--run-dir reach_tcp`` makes.
"""

import sys
from pathlib import Path

from frobs_core.util.files import write_aside, write_text
from frobs_devkit.parity import Certificate, measure_parity
from frobs_devkit.parity.certificate import markdown
from frobs_devkit.parity.draw import draw
from frobs_train import Run

DOCS = Path(__file__).parent
PAGE = DOCS / "how-to" / "parity-measured.md"
PICTURE = DOCS / "images" / "parity.png"
ID = "frobs/Irb120Reach-v0"
SHOWN = "saturated_step_response"
EPISODES = 500


def page(certificate: Certificate) -> str:
    """Return the page: the text of the certificate, with the table and only one of its pictures."""
    lines = []
    for line in markdown(certificate).splitlines():
        if line.startswith("!["):
            if f"({SHOWN}.png)" not in line:
                continue
            line = line.replace(f"{SHOWN}.png", f"../images/{PICTURE.name}")
        if line.startswith("| platform |"):  # Do not publish the machine on which the certificate was measured.
            continue
        lines.append(line)
    head, *rest = lines
    note = (
        "`docs/certificate.py` generated this certificate; `frobs parity` generates certificates of the same form. "
        "[Compare a task on several simulators](parity.md) explains certificates."
    )
    text = "\n".join([head.replace("Parity of", "Benchmarks: parity certificate of"), "", note, *rest])
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text + "\n"


if __name__ == "__main__":
    run, simulators = Run.open(sys.argv[1]), sys.argv[2:] or ["mujoco", "pybullet"]
    found = measure_parity(ID, simulators, run=run, episodes=EPISODES, on_measurement=print)
    shown = next(m for m in found.measurements if m.name == SHOWN)
    picture = draw(shown, found.simulators)
    write_aside(PICTURE, lambda aside: aside.write_bytes(picture))
    write_text(PAGE, page(found))
