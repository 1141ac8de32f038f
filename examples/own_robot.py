"""Train your own arm: all you need is its URDF file.

The script writes the URDF file of an arm with three joints, checks it, and trains the arm on a FRobs task that
works with any arm. The script prints the doctor's findings about the file, and then the success rate on 100 new goals.

Requires: pip install frobs
"""

import sys
from pathlib import Path

from frobs_devkit.doctor import examine_robot
from frobs_train import evaluate, resolve_config, train

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 60_000
FOLDER = Path("runs/examples")


def link(name: str, length: float, mass: float) -> str:
    """Return a link that is a rod along z, starting at the origin of the link."""
    inertia = mass * length**2 / 12.0
    return f"""
  <link name="{name}">
    <inertial>
      <origin xyz="0 0 {length / 2}"/> <mass value="{mass}"/>
      <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia / 20}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual>
      <origin xyz="0 0 {length / 2}"/> <geometry><cylinder radius="0.03" length="{length}"/></geometry>
    </visual>
    <collision>
      <origin xyz="0 0 {length / 2}"/> <geometry><cylinder radius="0.03" length="{length}"/></geometry>
    </collision>
  </link>"""


def joint(name: str, parent: str, child: str, height: float, axis: str) -> str:
    """Return a joint that connects the end of one rod to the start of the next."""
    return f"""
  <joint name="{name}" type="revolute">
    <parent link="{parent}"/> <child link="{child}"/>
    <origin xyz="0 0 {height}"/> <axis xyz="{axis}"/>
    <limit lower="-1.5" upper="1.5" velocity="3" effort="40"/>
  </joint>"""


FOLDER.mkdir(parents=True, exist_ok=True)
urdf = FOLDER / "three_joints.urdf"
urdf.write_text(
    '<robot name="three_joints">'
    + link("base", 0.3, 5.0)
    + joint("turn", "base", "shoulder", 0.3, "0 0 1")
    + link("shoulder", 0.1, 1.0)
    + joint("lift", "shoulder", "upper_arm", 0.1, "0 1 0")
    + link("upper_arm", 0.25, 1.0)
    + joint("bend", "upper_arm", "forearm", 0.25, "0 1 0")
    + link("forearm", 0.25, 0.6)
    + '<link name="tool"/><joint name="mount" type="fixed"><parent link="forearm"/><child link="tool"/>'
    + '<origin xyz="0 0 0.25"/></joint></robot>'
)

for finding in examine_robot(urdf, simulators=["mujoco"]).findings:
    print(f"{finding.severity}: {finding.about}: {finding.problem}")

config = resolve_config("frobs/Reach-v0", flags={"robot": str(urdf), "tcp": "tool", "seed": 0, "steps": STEPS})
run = train(config, FOLDER / "own_robot", on_existing="overwrite")
print(f"success on 100 new goals: {evaluate(run, episodes=100).success_rate:.0%}")
