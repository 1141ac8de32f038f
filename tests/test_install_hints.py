from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.util import install_hints
from frobs_core.util.install_hints import CHECKOUT, local_install_hint


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        ("pip install frobs-ros", "pip install -e plugins/frobs-ros"),
        ("pip install 'frobs-ros[ros]'", "pip install -e 'plugins/frobs-ros[ros]'"),
        ("pip install 'frobs-models[decomposition]'", "pip install -e 'plugins/frobs-models[decomposition]'"),
        ("pip install 'frobs-cli>=0.3,<0.4'", "pip install -e plugins/frobs-cli"),
        ("pip install frobs-cli frobs-ros, and ROS", "pip install -e plugins/frobs-cli -e plugins/frobs-ros, and ROS"),
        ("pip install frobs-sim-newton", "pip install frobs-sim-newton"),
        ("pip install acme-frobs-ros", "pip install acme-frobs-ros"),
        ("apt-get install xvfb", "apt-get install xvfb"),
    ],
)
def test_in_a_checkout_hints_name_the_folders(monkeypatch: pytest.MonkeyPatch, command: str, shown: str) -> None:
    monkeypatch.chdir(CHECKOUT)
    assert local_install_hint(command) == shown
    assert local_install_hint(shown) == shown


def test_elsewhere_hints_name_the_whole_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert local_install_hint("pip install frobs-ros") == f"pip install -e {CHECKOUT}/plugins/frobs-ros"


def test_installed_from_wheels_hints_name_the_distributions(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(install_hints, "CHECKOUT", tmp_path)
    assert local_install_hint("pip install frobs-ros") == "pip install frobs-ros"
