"""A client in another language, which has nothing but docs/protocol.md, and a device in real time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from installed import missing
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.serve.options import ServeOptions
from wificnc.serve.server import Server
from wificnc.wmc3.layout import Alarm, Refusal

ADDRESS, OWN = (f"127.{net}.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}" for net in (62, 63))
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))


@pytest.mark.skipif(sys.platform != "linux", reason="needs many loopback addresses")
def test_a_client_written_from_the_document_alone() -> None:
    """Handshake, an access key, keys, a jog, a stream that loses 30 % of its datagrams, datagrams, e-stop and reset."""
    node = shutil.which("node")
    if node is None:
        missing("a client in JavaScript needs node")
    options = ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=SETTINGS, key="geheim")
    with Server(options, "release"):
        command = [node, str(Path(__file__).with_name("client.mjs")), ADDRESS, OWN, "geheim"]
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANG_S)
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    stream = result.pop("stream")
    assert (stream["done"], stream["refusal"], stream["closed"]) == (400, Refusal.NONE, True)
    assert stream["dropped"] > 10
    assert result == {
        "name": "WiFiCNC", "locked": Refusal.AUTHENTICATION, "authenticated": True,
        "set": [True, True, Refusal.RANGE], "read": [20, 200.5], "exact": True,
        "estop": Alarm.ESTOP, "jog_in_estop": Refusal.LOCKED,
    }  # fmt: skip
