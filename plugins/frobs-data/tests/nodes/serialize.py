"""Serializes plain messages with rclpy: reads JSON lines (type, content), and writes the bytes of each as hex."""

import importlib
import json
import sys
from array import array
from typing import Any

from rclpy.serialization import serialize_message


def fill(message: Any, content: dict[str, Any]) -> Any:
    for name, value in content.items():
        field = getattr(message, name)
        if isinstance(value, dict):
            fill(field, value)
        else:
            setattr(message, name, array(field.typecode, value) if isinstance(field, array) else value)
    return message


for line in sys.stdin:
    kind, content = json.loads(line)
    package, _, name = kind.split("/")
    message = getattr(importlib.import_module(f"{package}.msg"), name)()
    sys.stdout.write(serialize_message(fill(message, content)).hex() + "\n")
