"""The HAL component: pins of LinuxCNC on one side, a stream of segments to a controller on the other."""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

from wificnc.errors import UserError
from wificnc.linuxcnc.link import Link
from wificnc.linuxcnc.pins import Pins
from wificnc.linuxcnc.slices import AXES
from wificnc.wmc3.device import Device

TICK_S = 0.01
SPINDLE_S = 0.001  # the encoder's pins
RETRY_S = 1.0
FIRST_S = 3.0  # LinuxCNC waits so long for a controller, then goes on without


def serve(link: Link, until_s: float = float("inf")) -> None:
    """Tick by tick. Raises UserError when the controller is gone."""
    due = time.monotonic()
    while due < until_s:
        link.tick()
        due = max(due + TICK_S, time.monotonic())
        while (left := due - time.monotonic()) > 0:
            time.sleep(min(left, SPINDLE_S) if link.encoder else left)
            link.follow_spindle()


def lose(pins: Pins, why: str) -> None:
    """The controller is gone."""
    print(f"wificnc: {why}", file=sys.stderr)
    pins["fault"] = bool(pins["fault"] or pins["enable"])
    for pin in ("connected", "ready", "estop-ok", "homing", "spindle-at-speed"):
        pins[pin] = False


def run(pins: Pins, asked: argparse.Namespace) -> None:
    """Connect, and connect again whenever the controller was gone. Ends by KeyboardInterrupt."""
    first_s = time.monotonic() + FIRST_S
    ready = False
    while True:
        try:
            with Device(asked.address, asked.password, timeout_s=0.5) as device:
                link = Link(pins, device, asked.queue_ms / 1e3, asked.run_up_s)
                while not ready and link.status is None:
                    serve(link, time.monotonic() + TICK_S)
                if not ready:
                    pins.ready()
                ready = True
                serve(link)
        except UserError as err:
            lose(pins, err.message)
            if not ready and time.monotonic() >= first_s:
                pins.ready()
                ready = True
            time.sleep(RETRY_S)


def main(argv: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python3 -m wificnc.linuxcnc", description=__doc__)
    parser.add_argument("--name", default="wificnc", help="of the component, and before its pins; one for each device")
    parser.add_argument("--address", required=True, help="IPv4 address of the controller")
    parser.add_argument("--password", default="", help="where the controller wants one")
    parser.add_argument("--joints", type=int, choices=range(1, AXES + 1), default=3)
    parser.add_argument("--queue-ms", type=float, default=100.0, help="motion that waits in the controller")
    parser.add_argument("--run-up-s", type=float, default=0.0, help="of a spindle without an encoder, until at speed")
    asked = parser.parse_args(argv)
    try:
        hal = importlib.import_module("hal")
    except ImportError:
        print("LinuxCNC is not here: its Python module hal comes with linuxcnc-uspace", file=sys.stderr)
        return 1
    pins = Pins(hal, asked.name, asked.joints)
    with suppress(KeyboardInterrupt):
        run(pins, asked)
    return 0
