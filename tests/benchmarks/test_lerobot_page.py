from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import lerobot_exchange


def test_the_page_shows_the_stored_exchange() -> None:
    file = lerobot_exchange.RESULTS / "lerobot" / "exchange.json"
    page = lerobot_exchange.report({"exchange": json.loads(file.read_text("utf-8"))})
    assert "lerobot 0.6" in page
    assert "bit for bit" in page
    assert "| 0 of 600 windows wrong |" in page
    assert "Training" not in page


def test_the_page_says_how_often_a_trained_policy_succeeds() -> None:
    found = {"versions": {"lerobot": "0.6.1"}, "date": "1 May 2027", "commit": "abc1234", "machine": "a machine"}
    found |= {"episodes": 100, "frames": 10_000, "steps": 5_000, "device": "cpu", "seconds": 600.0, "success": 84.0}
    page = lerobot_exchange.report({"training": found})
    assert "100 episodes of the expert" in page
    assert "5,000 steps on cpu in 10 minutes" in page
    assert "succeeds in 84 %" in page
