"""placeholder"""
from pathlib import Path
from frobs_core.models.model import RobotModel
from frobs_core.models.xmltree import Element
def read_mjcf(root: Element, path: Path) -> RobotModel:
    raise NotImplementedError
