"""A stream to a device, both in a network of their own that is bad; test_lossy.py runs it, and reads what it prints.

The bad network is there while segments go by UDP, and not while TCP opens and closes the stream: TCP repeats by itself
what is lost, a second late.
"""

from __future__ import annotations

import json
import subprocess

from test_lossy import SETTINGS, figure, position, segments
from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.stream import StreamSender
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

DEVICE = "127.0.0.1"
NETEM = ("netem", "loss", "30%", "duplicate", "30%", "delay", "10ms", "8ms")


def qdisc(*words: str) -> None:
    subprocess.run(["tc", "qdisc", *words], check=True)


def main() -> None:
    begun = False

    def follow(sender: StreamSender) -> None:
        nonlocal begun
        if not begun:
            qdisc("add", "dev", "lo", "root", *NETEM)
            begun = True
        if sender.is_executed:
            qdisc("del", "dev", "lo", "root")

    with Server(ServeOptions(board=load_board("host"), wmc3=DEVICE, settings=SETTINGS)), Device(DEVICE) as device:
        sender = device.stream(segments(figure(1000)), follow)
        print(json.dumps({"executed": sender.done, "position_steps": position(device)}))


if __name__ == "__main__":
    main()
