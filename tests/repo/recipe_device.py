"""A controller of this very tree in virtual time: sends lines and requests, prints what came of each as JSON.

`python recipe_device.py LINE...`; `request:NAME` is a request of the binary protocol without fields.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import Any

from wificnc.build.host import VARIANTS
from wificnc.connection.wmc3 import layout
from wire_device import Device

STEP_S = 0.001
LONGEST_S = 60.0


def answered(device: Device, line: str) -> dict[str, Any]:
    """What the line was answered, how long that took, and where the machine is when it has come to rest."""
    begin_s, said = device.now, ""
    device.text(line if line == "?" else line + "\n")
    while not any(end in said for end in ("ok\r\n", "error:", ">\r\n")):
        assert device.now < begin_s + LONGEST_S, f"no answer to {line}: {said}"
        device.run(STEP_S)
        said += device.heard()
    seconds = device.now - begin_s
    while device.state != "Idle":
        assert device.now < begin_s + LONGEST_S, f"{line} does not end: {device.state}"
        device.run(STEP_S)
    return {"said": said, "seconds": seconds, "steps": device.pulses}


def replied(device: Device, name: str) -> dict[str, Any]:
    """The name of the reply, and its fields."""
    payload = device.request(device.connect(), getattr(layout, name)()).payload
    return {"reply": type(payload).__name__, "now_s": device.now, **asdict(payload)}


def main(words: list[str]) -> None:
    VARIANTS["release"] = (("-O0",), ())  # compiled for a few lines: that takes longer than they do
    device = Device()
    results = []
    for word in words:
        name = word.removeprefix("request:")
        results.append(replied(device, name) if name != word else answered(device, word))
    device.close()
    print(json.dumps(results))


if __name__ == "__main__":
    main(sys.argv[1:])
