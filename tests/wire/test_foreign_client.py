"""A client in another language, which has nothing but docs/protocol.md, and a device in real time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from board_keys import published_keys
from installed import missing
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.connection.wmc3.layout import Alarm, Refusal
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

ADDRESS, OWN = (f"127.{net}.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}" for net in (62, 63))
RANGES = (  # of docs/protocol.md
    (0x0312, 0x0312), (0x0400, 0x0400), (0x0430, 0x0430), (0x0500, 0x0519), (0x0520, 0x0522), (0x0524, 0x0525),
    (0x0530, 0x0533), (0x0700, 0x0704),
)  # fmt: skip
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))


@pytest.mark.skipif(sys.platform != "linux", reason="needs many loopback addresses")
def test_a_client_written_from_the_document_alone() -> None:
    """Handshake, access key, every key of the board against its file, pins, network, a jog, datagrams, e-stop, reset.

    And a stream that loses 30 % of its datagrams.
    """
    node = shutil.which("node")
    if node is None:
        missing("a client in JavaScript needs node")
    options = ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=SETTINGS, key="geheim")
    with Server(options, "release"):
        ranges = ",".join(f"{first}-{last}" for first, last in RANGES)
        command = [node, str(Path(__file__).with_name("client.mjs")), ADDRESS, OWN, "geheim", ranges]
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANG_S)
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    stream = result.pop("stream")
    assert (stream["done"], stream["refusal"], stream["closed"]) == (400, Refusal.NONE, True)
    assert stream["dropped"] > 10
    expected = published_keys(load_board("host").path)
    keys = {int(key): value for key, value in result.pop("keys").items()}
    assert {key: keys.pop(key) for key in expected} == expected, "what the board file says"
    assert keys == {0x0400: 10_000, 0x0430: 5000, 0x0524: 0}
    assert result == {
        "pins": [True, True, True, True, Refusal.PIN, Refusal.READ_ONLY],
        "network": [True, Refusal.RANGE, True, True, "shop", "", "mill"],
        "name": "WiFiCNC", "locked": Refusal.AUTHENTICATION, "authenticated": True,
        "set": [True, True, Refusal.RANGE], "read": [20, 200.5], "exact": True,
        "estop": Alarm.ESTOP, "jog_in_estop": Refusal.LOCKED,
    }  # fmt: skip
