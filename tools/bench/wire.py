"""Measure a serving controller as a host of the binary protocol sees it: python -m bench.wire [--seconds N]."""

from __future__ import annotations

import argparse
import os
import platform
import textwrap
from contextlib import ExitStack

from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.layout import Jog, JogStop
from wificnc.connection.wmc3.measure import measure_reports, measure_trips, method
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

# the ports are fixed: every run has an address of its own
ADDRESS = f"127.59.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"
TRIPS = 2000
INTERVALS_MS = (50, 10)
TRIP_MS, JITTER_MS = 2.0, 2.0  # the median, and 99 of 100
JOG_STEPS_S = 20_000
SETTINGS = ("$100=200", "$110=6000", "$120=500", "$20=0")

HEAD = (
    "`wificnc serve --wmc3` in real time and one host on this computer, over its loopback device. While it moves, X "
    "jogs at {speed:,} steps/s. Other work on this computer shows in the figures: see its load. {words}"
)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="of reports, each time")
    asked = parser.parse_args()
    load = f"load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load unknown"
    print(f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} processors, {load}")
    good = True
    for interval_ms in INTERVALS_MS:
        for moves in (False, True):
            good &= measure(interval_ms, moves, asked.seconds)
    print(f"Budget: median of the round trip {TRIP_MS} ms, 99 of 100 reports within {JITTER_MS} ms.")
    return 0 if good else 1


def measure(interval_ms: int, moves: bool, seconds: float) -> bool:
    """One controller; its figures on one line."""
    options = ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=(*SETTINGS, f"$76={interval_ms}"))
    with ExitStack() as stack:
        stack.enter_context(Server(options))
        device = stack.enter_context(Device(ADDRESS))
        if moves:
            device.command(Jog(0, 1, JOG_STEPS_S))
        trips = measure_trips(device, TRIPS)
        reports = measure_reports(device, seconds)
        device.command(JogStop(0xFF))
    if (interval_ms, moves) == (INTERVALS_MS[0], False):
        print(textwrap.fill(HEAD.format(speed=JOG_STEPS_S, words=method(trips, reports)), 120))
    print(
        f"  every {interval_ms:2} ms, {'moving  ' if moves else 'standing'}  "
        f"round trip {trips.median_ms:.3f} ms, 99 % {trips.p99_ms:.3f}, most {trips.most_ms:.3f}  "
        f"reports {reports.mean_ms:.3f} ms, jitter {reports.median_jitter_ms:.3f}, 99 % {reports.p99_jitter_ms:.3f}, "
        f"most {reports.most_jitter_ms:.3f}"
    )
    return trips.median_ms <= TRIP_MS and reports.p99_jitter_ms <= JITTER_MS


if __name__ == "__main__":
    raise SystemExit(main())
