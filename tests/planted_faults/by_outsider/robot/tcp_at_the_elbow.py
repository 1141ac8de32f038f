"""The tool center point is the link of the forearm, whose origin is at the elbow, not at the tool."""

from __future__ import annotations

from dataclasses import replace

from templates.my_arm import MY_ARM

FAULTY = replace(MY_ARM, tcp="forearm")
