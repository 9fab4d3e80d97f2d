"""How fast and how evenly a device answers, measured from here. It moves nothing."""

from __future__ import annotations

import socket
import statistics
import struct
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from wificnc.connection.wmc3.device import Device, find_key
from wificnc.connection.wmc3.layout import JogStop, Ping, Pong, Status
from wificnc.connection.wmc3.packet import parse
from wificnc.errors import LinkError

KERNEL_STAMPS = 35  # SO_TIMESTAMPNS of Linux; Python has no name for it
PATIENCE_S = 3.0


@dataclass(frozen=True)
class Trips:
    """Round trips, ms: from the first byte of a ping to the last of its pong, one after the other."""

    count: int
    median_ms: float
    p99_ms: float
    most_ms: float


@dataclass(frozen=True)
class Reports:
    """Status reports. Jitter: how far the time between two of them is from the interval that is set, ms."""

    count: int
    interval_ms: int  # as it is set
    mean_ms: float
    median_jitter_ms: float
    p99_jitter_ms: float
    most_jitter_ms: float
    device_jitter_ms: float  # the most by the device's own time stamps
    stamps: str  # who said when one came: "kernel" or "program"


def method(trips: Trips, reports: Reports) -> str:
    """What the figures are, in words."""
    return (
        f"Round trip: {trips.count} pings by TCP one after the other, from the first byte to the last of the pong. "
        f"Jitter: of {reports.count} reports the difference between the time from one to the next and the interval "
        f"that is set, {reports.interval_ms} ms; arrival as the {reports.stamps} of this computer stamps it."
    )


def measure_trips(device: Device, count: int) -> Trips:
    """Raises LinkError."""
    trips = []
    for number in range(count):
        begin = time.perf_counter()
        device.request(Ping(number), Pong)
        trips.append(1e3 * (time.perf_counter() - begin))
    return Trips(count, statistics.median(trips), _part(trips, 0.99), max(trips))


def measure_reports(device: Device, seconds: float) -> Reports:
    """Raises LinkError when there are too few."""
    interval_ms = int(device.get(find_key("status_interval_ms")[0]))
    listener = device.listen()
    kernel = _ask_for_stamps(listener)
    device.post(JogStop(axis=0xFF))
    came = list(_reports(device, listener, seconds))[1:]  # the first one comes immediately
    if len(came) < 3:
        raise LinkError(f"only {len(came)} reports in {seconds} s", hint="status_interval_ms sets their interval")
    gaps = [1e3 * (b - a) for (a, _), (b, _) in pairwise(came)]
    jitter = [abs(gap - interval_ms) for gap in gaps]
    own = [abs(((b - a) & 0xFFFFFFFF) / 1e3 - interval_ms) for (_, a), (_, b) in pairwise(came)]
    return Reports(
        len(came), interval_ms, statistics.fmean(gaps), statistics.median(jitter), _part(jitter, 0.99), max(jitter),
        max(own), "kernel" if kernel else "program",
    )  # fmt: skip


def _part(values: Sequence[float], part: float) -> float:
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def _ask_for_stamps(listener: socket.socket) -> bool:
    """The kernel's time of arrival does not wait for this program to be scheduled. Only Linux has it."""
    if sys.platform != "linux":
        return False
    try:
        listener.setsockopt(socket.SOL_SOCKET, KERNEL_STAMPS, 1)
    except OSError:
        return False
    return True


def _reports(device: Device, listener: socket.socket, seconds: float) -> Iterator[tuple[float, int]]:
    """When each one came, s, and its own time stamp, us."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        listener.settimeout(min(left, PATIENCE_S))
        try:
            data, address, now = _receive(listener)
        except TimeoutError:
            return
        packet = parse(data)
        if address == device.address and packet and isinstance(packet.payload, Status):
            yield now, packet.header.timestamp_us


def _receive(listener: socket.socket) -> tuple[bytes, str, float]:
    """A datagram, the address that it is from, and when it came, s. Raises TimeoutError."""
    if sys.platform == "win32":
        data, (address, _) = listener.recvfrom(512)
        return data, address, time.time()
    data, extra, _, (address, _) = listener.recvmsg(512, 64)
    return data, address, next((_stamp(value) for _, _, value in extra), time.time())


def _stamp(value: bytes) -> float:
    seconds, nanoseconds = struct.unpack("qq", value[:16])
    return float(seconds) + float(nanoseconds) * 1e-9
