import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for clean.py
sys.path.insert(0, str(Path(__file__).parents[1] / "cookiecutter"))  # for wheels.py

collect_ignore = ["scaffold_0.2"]  # its tests run where it is installed
