"""A network that loses 30 %, doubles 30 % and reorders, over real sockets: steps are exact, losses are reported.

By our own proxy (lossy.py), and by the kernel's netem where it has that. Steps are asserted, never speed.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from lossy import Lossy
from patience import HANG_S, wait_until
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.layout import Motion, Resume, Segment, State, Statistics, StatisticsResponse, Status, Type
from wificnc.connection.wmc3.packet import parse
from wificnc.connection.wmc3.stream import StreamSender
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

HERE = Path(__file__).parent
OWN = f"{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
DEVICE, ADDRESS = f"127.64.{OWN}", f"127.65.{OWN}"
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))
BAD = {"loss": 0.3, "duplicate": 0.3, "delay_ms": (0.0, 20.0)}

try:
    socket.create_server((ADDRESS, 0)).close()
except OSError:
    pytest.skip("127.0.0.1 is this computer's only address of its kind", allow_module_level=True)


@pytest.fixture
def make_network() -> Iterator[Callable[..., Lossy]]:
    """A device with these settings, and a bad network before it."""
    with ExitStack() as stack:

        def make(*settings: str, **how: object) -> Lossy:
            options = ServeOptions(board=load_board("host"), wmc3=DEVICE, settings=(*SETTINGS, *settings))
            stack.enter_context(Server(options))
            return stack.enter_context(Lossy(DEVICE, ADDRESS, **{**BAD, **how}))

        yield make


def figure(count: int) -> list[tuple[int, int]]:
    """Places 1 ms apart on a figure of eight of 10 x 5 mm, passed twice."""
    turns = (4 * math.pi * k / count for k in range(count + 1))
    return [(round(2000 * math.sin(t)), round(500 * math.sin(2 * t))) for t in turns]


def segments(places: list[tuple[int, int]], us: int = 1000) -> list[Segment]:
    """Numbered from 1."""
    ways = [(after[0] - before[0], after[1] - before[1]) for before, after in pairwise(places)]
    return [Segment((x, y, 0, 0, 0, 0), us, id=k) for k, (x, y) in enumerate(ways, start=1)]


def statistics(device: Device) -> StatisticsResponse:
    return device.request(Statistics(), StatisticsResponse)


def position(device: Device) -> tuple[int, ...]:
    """Where it is, as two reports say it one after the other."""
    for before, after in pairwise(device.reports(HANG_S)):
        if before.position_steps == after.position_steps and after.state == State.IDLE:
            return after.position_steps
    raise AssertionError("it does not stand")


def drained(listener: socket.socket) -> Iterator[Status]:
    """Reports that have come."""
    listener.setblocking(False)
    while True:
        try:
            packet = parse(listener.recv(512))
        except BlockingIOError:
            return
        if packet and isinstance(packet.payload, Status):
            yield packet.payload


def check_path(reports: list[Status], places: list[tuple[int, int]]) -> None:
    """Every report is on the path, in the segment that it names; and what was passed once is never passed again."""
    at, moving = 0, 0
    for report in sorted(reports, key=lambda report: report.uptime_ms):
        x, y = report.position_steps[:2]
        if not report.segment_id:  # between two segments, or before the first
            assert (x, y) in places[at:], (report, at)
            continue
        assert report.segment_id >= at, "back again"
        at, moving = report.segment_id, moving + 1
        (x0, y0), (x1, y1) = places[at - 1 : at + 1]
        part = np.clip(((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(1, (x1 - x0) ** 2 + (y1 - y0) ** 2), 0, 1)
        assert max(abs(x0 + part * (x1 - x0) - x), abs(y0 + part * (y1 - y0) - y)) <= 1, (report, places[at])
    assert moving > 5, "the path was looked at"


@pytest.mark.slow
def test_a_stream_over_a_bad_network(make_network: Callable[..., Lossy]) -> None:
    """Thousands of segments, and a quarter of a second in which the network is gone: a pause, which is reported."""
    network = make_network("$76=10")
    places = figure(2500)
    reports: list[Status] = []
    with Device(ADDRESS) as device:
        listener = device.listen()
        device.handshake()
        gone_until = 0.0

        def follow(sender: StreamSender) -> None:
            nonlocal gone_until
            reports.extend(drained(listener))
            if not gone_until and sender.done > 1000:
                gone_until = time.monotonic() + 0.25
                network.loss = 1.0
                while time.monotonic() < gone_until:
                    time.sleep(0.01)
                network.loss = BAD["loss"]

        sender = device.stream(segments(places), follow)
        reports.extend(drained(listener))
        assert (sender.done, sender.next) == (2500, 2500)
        counts = statistics(device)
        assert (counts.segments, counts.done, counts.refused_segments) == (2500, 2500, 0)
        assert sender.underruns == counts.underruns >= 1, "the queue was not long enough for that, and it is reported"
        assert position(device) == (*places[-1], 0, 0, 0, 0)
    check_path(reports, places)
    for way in (network.to_device, network.to_host):
        assert min(way.lost, way.doubled, way.overtaken) > 20, "the network was bad"


def test_the_command_line_over_a_bad_network(make_network: Callable[..., Lossy]) -> None:
    network = make_network()
    for _ in range(2):
        result = CliRunner().invoke(
            root, ["wmc3", "motion", "--to", ADDRESS, "X=3000", "Y=-1234", "--speed", "15000", "--json"]
        )
        assert result.exit_code == 0, result.output
        assert json.loads(result.output)["executed"] == 20
    network.loss = network.duplicate = 0.0
    with Device(ADDRESS) as device:
        assert position(device) == (6000, -2468, 0, 0, 0, 0)


def test_without_a_stream_every_gap_is_counted(make_network: Callable[..., Lossy]) -> None:
    """What arrives is made once, what does not is counted: nothing is lost in silence. $78=0: and nothing is held."""
    network = make_network("$78=0")
    sent: dict[int, Segment] = {}
    with Device(ADDRESS) as device:
        for count, segment in enumerate(segments(figure(400), us=3000)):
            device.post(Motion(count=1), [segment])
            sent[device._sequence] = segment  # that it had
            time.sleep(0.003)
            if count % 32 == 31:  # no more than its queue holds, however late this computer is
                wait_until(lambda: _queued(device) < 64, "the queue empties")
        way = network.to_device
        wait_until(lambda: way.came == len(sent) and not way.on_way, "all have met their fate")
        wait_until(lambda: statistics(device).datagrams == way.delivered and not _queued(device), "all is executed")
        counts = statistics(device)
        arrived = [packet.header.sequence for packet in _motion(network)]
        made = [sent[number].steps for number in dict.fromkeys(arrived)]
        newest = device._sequence
        network.loss = network.duplicate = 0.0
        assert position(device) == tuple(map(sum, zip(*made, strict=True)))
    gaps = set(range(arrived[0], newest)) & sent.keys() - set(arrived)
    assert len(gaps) > 50 and counts.missing == len(gaps)
    assert counts.duplicates == len(arrived) - len(made) > 50
    assert counts.segments == counts.done == len(made) and counts.refused_segments == 0


def _queued(device: Device) -> int:
    counts = statistics(device)
    return counts.segments - counts.done


def _motion(network: Lossy) -> list:
    packets = map(parse, list(network.delivered))
    return [packet for packet in packets if packet and packet.header.type == Type.MOTION]


def test_hold_on_gap_stops_before_what_is_behind_the_gap(make_network: Callable[..., Lossy]) -> None:
    network = make_network("$78=1", loss=0.0, duplicate=0.0, delay_ms=(0.0, 0.0))
    with Device(ADDRESS) as device:

        def post(*steps: tuple[int, int]) -> None:
            device.post(Motion(count=len(steps)), [Segment((x, y, 0, 0, 0, 0), 10_000) for x, y in steps])

        post(*[(50, 0)] * 8)
        wait_until(lambda: len(network.delivered) == 1, "it is there")
        network.loss = 1.0
        post(*[(50, 0)] * 8)
        wait_until(lambda: network.to_device.lost == 1, "it is lost")
        network.loss = 0.0
        post(*[(0, 50)] * 8)
        reports = device.reports(HANG_S)
        report = next(report for report in reports if report.state == State.HOLD)
        still = next(after for before, after in pairwise(reports) if before.position_steps == after.position_steps)
        assert report.position_steps[1] == still.position_steps[1] == 0, "no cut where no one wanted one"
        assert statistics(device).missing == 1
        device.command(Resume())
        wait_until(lambda: position(device) == (400, 400, 0, 0, 0, 0), "who has looked at it may go on")


def _namespace(*command: str) -> subprocess.CompletedProcess[str]:
    """In a network of its own, of one device lo."""
    isolate = ("unshare", "-n") if os.geteuid() == 0 else ("unshare", "-rn")
    script = 'ip link set lo up && exec "$@"'
    argv = [*isolate, "sh", "-c", script, "sh", *command]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # noqa: TID251
    return subprocess.run(argv, capture_output=True, text=True, timeout=HANG_S, env=environment)


def test_a_stream_over_netem() -> None:
    """The same by the kernel's own bad network."""
    if not all(map(shutil.which, ("unshare", "ip", "tc"))):
        pytest.skip("unshare, ip or tc is not here; the proxy's tests do the same")
    tried = _namespace("tc", "qdisc", "add", "dev", "lo", "root", "netem", "loss", "1%")
    if tried.returncode != 0:
        pytest.skip(f"this kernel has no netem ({tried.stderr.strip()}); the proxy's tests do the same")
    done = _namespace(sys.executable, str(HERE / "over_netem.py"))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"executed": 1000, "position_steps": [*figure(1000)[-1], 0, 0, 0, 0]}
