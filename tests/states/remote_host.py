"""Two remote hosts of a controller in virtual time (targets/pc/host_wire.h): the first one does all, the second one
only tries. What they send is named as in protocol/states.toml."""

from __future__ import annotations

import ctypes
import socket
import struct

from c_library import LIB
from generate.states_table import Input
from grbl_host import HZ, Grbl
from wificnc.connection.wmc3.layout import (
    Ack,
    Authenticate,
    Authenticated,
    ChannelOutputs,
    ConfigSave,
    ConfigSet,
    Estop,
    Hold,
    Home,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Ping,
    Refusal,
    Refused,
    Reset,
    Resume,
    Segment,
    Statistics,
    StatisticsResponse,
    StreamAck,
    StreamClose,
    StreamDrop,
    StreamOpen,
    StreamOpened,
    StreamSegments,
    Take,
    ValueType,
)  # fmt: skip
from wificnc.connection.wmc3.packet import build, parse
from wificnc.connection.wmc3.packing import Layout
from wificnc.simulator.library import HostBoard

HOST, OTHER, PORT = "10.0.0.2", "10.0.0.3", 40_000
ALIVE_S = 0.2
RPM = 900  # not that of the text side
LONG = Segment(steps=(-9000, 0, 0, 0, 0, 0), duration_us=900_000_000)
SHORT = Segment(steps=(-10, 0, 0, 0, 0, 0), duration_us=200_000)
STATUS_INTERVAL_MS = 0x0103
SENT = ctypes.byref(ctypes.c_uint32()), ctypes.byref(ctypes.c_uint16()), ctypes.create_string_buffer(600)  # of one call
PORTS = {"digital_inputs": 4, "analog": 1, "digital_outputs": 5, "toolsetter": 1}
BOARD = HostBoard(HZ, 1000, 500, 500_000, 3, dial=4, **PORTS)
ON, OFF = IoControl(spindle=1, rpm=RPM, coolant=1), IoControl()

PAYLOADS: dict[str, Layout] = {
    "host_asks": Ping(1),
    "host_authenticates": Authenticate(),
    "host_takes": Take(),
    "host_hold": Hold(),
    "host_resume": Resume(),
    "host_reset": Reset(),
    "host_estop": Estop(),
    "host_jog": Jog(0, -1, 100),
    "host_jog_stop": JogStop(0xFF),
    "host_home": Home(7),
    "host_opens": StreamOpen(),
    "host_outputs": ON,
    "host_outputs_off": OFF,
    "host_sets": ConfigSet(STATUS_INTERVAL_MS, ValueType.U16, struct.pack("<H", 100).ljust(64, b"\0")),
    "host_saves": ConfigSave(),
    "host_switches": ChannelOutputs(),
    "other_host": ConfigSave(),
    "other_host_hold": Hold(),
}  # and those that need a number: motion, segments, closes, drops


def number(address: str) -> int:
    return int(struct.unpack(">I", socket.inet_aton(address))[0])


def refusal_name(refusal: int) -> str:
    return "done" if refusal == Refusal.NONE else Refusal(refusal).name.lower()


class RemoteHosts(Grbl):
    """A controller with its text side, and remote hosts at its network."""

    def __init__(self) -> None:
        super().__init__(board=BOARD)
        self._wire = LIB.host_wire_create(self._host, b"")
        self._places: dict[str, int] = {}
        self._sequence = 0
        self._stream = self._next = 0
        self._jogs = False

    def close(self) -> None:
        try:
            super().close()
        finally:
            LIB.host_wire_destroy(self._wire)

    def after(self, seconds: float, data: str = "") -> str:
        self.put(data)
        LIB.host_input_follows(self._host, 0)
        end = LIB.host_time_ticks(self._host) + round(seconds * HZ)
        while (now := LIB.host_time_ticks(self._host)) < end:
            if self._stream and HOST in self._places:
                self._request(Ping(1))  # a stream whose host is silent is lost
            until = min(end, now + round(ALIVE_S * HZ))
            LIB.host_wire_run(self._wire, until)
            if self._jogs and self.state() == "Jog":
                self._request(PAYLOADS["host_jog"])  # a jog that is not repeated ends
            elif until - now >= round(ALIVE_S * HZ):
                self._jogs = False
        self._skip()
        return self.heard()

    def state(self) -> str:
        """As a report would show it, without asking for one."""
        return str(LIB.host_state(self._host).decode())

    def lose_host(self) -> None:
        """Its connection ends at its own end."""
        if HOST in self._places:
            LIB.host_wire_disconnect(self._wire, self._places.pop(HOST))
            self._jogs = False

    def packet(self, entry: Input) -> str:
        """Send what stands for this input. Returns `done`, `reply`, or the name of the refusal."""
        address = OTHER if entry.other_host else HOST
        self._connect(address)
        if entry.name == "host_motion":
            return self._motion()
        if entry.name == "host_segments":
            return self._segments()
        payload = PAYLOADS.get(entry.name)
        if payload is None:
            payload = {"host_closes": StreamClose, "host_drops": StreamDrop}[entry.name](self._stream)
        reply = self._request(payload, address)
        if isinstance(reply, StreamOpened) and reply.refusal == Refusal.NONE:
            self._stream, self._next = reply.stream, 0
        if isinstance(reply, (Ack, Authenticated)):
            self._jogs |= entry.name == "host_jog"
            return "done"
        if isinstance(reply, Refused):
            return refusal_name(reply.reason)
        return refusal_name(reply.refusal) if isinstance(reply, StreamOpened) else "reply"

    def _connect(self, address: str) -> None:
        if address not in self._places:
            self._places[address] = int(LIB.host_wire_connect(self._wire, number(address)))

    def _build(self, payload: Layout, *segments: Segment) -> bytes:
        self._sequence += 1
        return build(payload, self._sequence, round(self.time() * 1e6) + self._sequence, segments)

    def _request(self, payload: Layout, address: str = HOST) -> Layout:
        data, reply = self._build(payload), ctypes.create_string_buffer(512)
        size = LIB.host_wire_request(self._wire, self._places[address], data, len(data), reply)
        packet = parse(reply.raw[:size])
        assert packet is not None
        return packet.payload

    def _datagram(self, payload: Layout, segment: Segment) -> list[Layout]:
        data = self._build(payload, segment)
        LIB.host_wire_datagram(self._wire, number(HOST), PORT, data, len(data))
        return self._fetch()

    def _fetch(self) -> list[Layout]:
        """What was sent since the last time."""
        found = []
        while size := LIB.host_wire_sent(self._wire, *SENT, len(SENT[2])):
            packet = parse(SENT[2][:size])
            assert packet is not None
            found.append(packet.payload)
        return found

    def _skip(self) -> None:
        """What was sent since the last time, unread."""
        while LIB.host_wire_sent(self._wire, *SENT, len(SENT[2])):
            pass

    def _refused(self) -> StatisticsResponse:
        response = self._request(Statistics())
        assert isinstance(response, StatisticsResponse)
        return response

    def _motion(self) -> str:
        before = self._refused().refused_segments
        self._datagram(Motion(count=1), SHORT)
        after = self._refused()
        return refusal_name(after.last_refusal if after.refused_segments != before else Refusal.NONE)

    def _segments(self) -> str:
        sent = self._datagram(StreamSegments(self._stream, self._next, 1), LONG)
        ack = next(payload for payload in sent if isinstance(payload, StreamAck))
        if ack.refusal == Refusal.NONE:
            self._next += 1
        return refusal_name(ack.refusal)
