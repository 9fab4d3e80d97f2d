"""A device of the binary protocol in virtual time, and what it does with its motors. Talks to targets/pc."""

from __future__ import annotations

import ctypes
import os
import socket
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from c_library import LIB
from layouts import HOST as LAYOUTS
from monitor import Monitor
from numpy.typing import NDArray
from step_log import StepLog
from wificnc.board.model import Board
from wificnc.connection.access import key_secret
from wificnc.connection.wmc3.layout import (
    JOG_REPEAT_MS,
    STATUS_PORT,
    Authenticate,
    Authenticated,
    Challenge,
    ChallengeResponse,
    Jog,
    Motion,
    Refusal,
    Refused,
    Segment,
    Status,
    Type,
)
from wificnc.connection.wmc3.packet import Packet, build, parse
from wificnc.connection.wmc3.packing import Layout
from wificnc.connection.wmc3.seal import Sealer, proof
from wificnc.simulator.library import DeviceBoard, HostBoard
from wificnc.simulator.serve.options import device_text

AXES = 6
TIMER_HZ = 20_000_000
HOST = "10.0.0.2"
OTHER = "10.0.0.3"
TRUST_NOT, TRUST_DAY, TRUST_ALWAYS = range(3)  # enum access_span
# 200 steps/mm, 6000 mm/min = 20000 steps/s, 500 mm/s2 = 100000 steps/s2
SETTINGS = {base + ax: value for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(AXES)}
RATE, ACCEL = 20_000, 100_000
PATIENT = {77: 60_000}  # a host that has queued all of it may be silent


def number(address: str) -> int:
    return int(struct.unpack(">I", socket.inet_aton(address))[0])


@dataclass
class Sent:
    """A datagram of the device."""

    time_s: float
    address: str
    port: int
    data: bytes

    @property
    def packet(self) -> Packet:
        packet = parse(self.data)
        assert packet is not None
        return packet


def device_board(board: Board) -> Any:
    """A pointer to what `wificnc serve` passes on of a board's pins."""
    made = DeviceBoard()
    assert LIB.host_device_parse(device_text(board).encode(), ctypes.byref(made))
    return ctypes.pointer(made)


class Device:
    """A controller and its network. Time advances only in run()."""

    def __init__(
        self,
        key: str = "",
        settings: dict[int, float] | None = None,
        store: str | None = None,
        axes: int = AXES,
        **more: Any,
    ) -> None:
        """more: fields of HostBoard that are otherwise."""
        self.lib = LIB
        inputs_outputs = {"digital_inputs": 4, "digital_outputs": 5, **more}
        board = HostBoard(TIMER_HZ, 1000, 500, 500_000, axes, **inputs_outputs)
        self.host = self.lib.host_open(ctypes.byref(board), store.encode() if store else None)
        assert self.host
        self.monitor = Monitor(self.lib, self.host)
        self.wire = self.lib.host_wire_create(self.host, key.encode())
        self.sequence = 0
        self.sealer: Sealer | None = None  # of HOST
        self.sent: list[Sent] = []
        self.steps = StepLog()
        self.lib.trace_add(self.lib.host_trace(self.host), self.steps.consumer, None)
        known = {key: value for key, value in SETTINGS.items() if key % 10 < axes}
        for key, value in {**known, **(settings or {})}.items():
            self.text(f"${key}={value:g}\n")
            self.run(0.001)
        self.heard()

    def close(self) -> None:
        try:
            self.monitor.close()
        finally:
            self.lib.host_wire_destroy(self.wire)
            self.lib.host_destroy(self.host)

    # ---- time, text, machine ----

    @property
    def now(self) -> float:
        """Virtual time, s."""
        return float(self.lib.host_time_ticks(self.host)) / TIMER_HZ

    def run(self, seconds: float) -> None:
        """Let time advance; what the device sends is in .sent, with the time to a ms."""
        self.run_until(self.now + seconds)

    def run_until(self, time_s: float) -> None:
        self.lib.host_wire_run(self.wire, round(time_s * TIMER_HZ))
        self.fetch()

    def fetch(self) -> None:
        """What it has sent up to now."""
        address, port = ctypes.c_uint32(), ctypes.c_uint16()
        data = ctypes.create_string_buffer(600)
        while size := self.lib.host_wire_sent(self.wire, ctypes.byref(address), ctypes.byref(port), data, 600):
            to = socket.inet_ntoa(struct.pack(">I", address.value))
            self.sent.append(Sent(self.now, to, port.value, data.raw[:size]))

    def text(self, line: str) -> None:
        assert self.lib.host_write(self.host, line.encode(), len(line)) == len(line)

    def heard(self) -> str:
        """What the text side said since the last call."""
        out = ctypes.create_string_buffer(1 << 16)
        size = self.lib.host_read(self.host, out, len(out))
        return out.raw[:size].decode()

    def input(self, name: str, active: bool) -> None:
        self.lib.virtual_set(self.host, self.lib.virtual_input_number(name.encode()), active)

    @property
    def state(self) -> str:
        return str(self.lib.host_state(self.host).decode())

    @property
    def position(self) -> list[int]:
        """Pulses that left the pins, as counted by the controller."""
        steps = (ctypes.c_int32 * AXES)()
        self.lib.host_position_steps(self.host, steps)
        return list(steps)

    def outputs(self) -> Any:
        """struct virtual_outputs: what the pins show."""
        outputs = LAYOUTS.struct("virtual_outputs")()
        self.lib.virtual_outputs(self.host, ctypes.byref(outputs))
        return outputs

    def duty(self) -> int:
        """PWM of the spindle or laser, 0 .. 65535."""
        return int(self.outputs().spindle_duty)

    # ---- steps ----

    def edges(self, axis: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Times of an axis' pulses, s, and their directions."""
        events = self.steps.events()
        mine = events[(events["step"] >> axis & 1) != 0]
        return mine["t"] / TIMER_HZ, np.where((mine["dir"] >> axis & 1) != 0, -1, 1).astype(np.int64)

    @property
    def pulses(self) -> list[int]:
        """Sum of the pulses on the pins."""
        return [int(self.edges(axis)[1].sum()) for axis in range(AXES)]

    # ---- network ----

    def raw(self, data: bytes, address: str = HOST, port: int = 40000) -> None:
        self.lib.host_wire_datagram(self.wire, number(address), port, data, len(data))
        self.fetch()

    def send(self, payload: Layout, segments: tuple[Segment, ...] = (), address: str = HOST, port: int = 40000) -> None:
        """A datagram with the next sequence number, immediately; sealed when HOST has proven itself."""
        packet = build(payload, self.sequence, round(self.now * 1e6) + 1, segments)
        self.raw(self.sealer.seal(packet) if self.sealer and address == HOST else packet, address, port)
        self.sequence += 1

    def motion(self, *segments: Segment, address: str = HOST) -> None:
        self.send(Motion(count=len(segments)), segments, address)

    def jog(self, jog: Jog, seconds: float, address: str = HOST) -> None:
        """A jog that is repeated as our hosts do."""
        end = round((self.now + seconds) * TIMER_HZ) / TIMER_HZ  # a time that run_until() reaches
        while self.now < end:
            self.send(jog, address=address)
            self.run_until(min(end, self.now + JOG_REPEAT_MS / 1000))

    def connect(self, address: str = HOST) -> int:
        return int(self.lib.host_wire_connect(self.wire, number(address)))

    def disconnect(self, client: int) -> None:
        self.lib.host_wire_disconnect(self.wire, client)

    def raw_request(self, client: int, data: bytes) -> Packet | None:
        reply = ctypes.create_string_buffer(512)
        size = self.lib.host_wire_request(self.wire, client, data, len(data), reply)
        self.fetch()
        return parse(reply.raw[:size]) if size else None

    def request(self, client: int, payload: Layout) -> Packet:
        reply = self.raw_request(client, build(payload, self.sequence, 0))
        self.sequence += 1
        assert reply is not None
        return reply

    def prove(self, client: int, key: str) -> Refusal:
        return self.prove_later(client, key)[0]

    def prove_later(self, client: int, key: str) -> tuple[Refusal, float]:
        """Authenticate a connection, HOST's datagrams are sealed from now on; and after how many s the answer came."""
        asked = self.request(client, Challenge()).payload
        assert isinstance(asked, ChallengeResponse)
        secret, nonce = key_secret(key, asked.salt, asked.rounds), os.urandom(len(asked.nonce))
        proven = build(Authenticate(nonce, proof(secret, asked.nonce, nonce)), self.sequence, 0)
        begin_s = self.now
        while (reply := self.raw_request(client, proven)) is None:
            self.run(0.01)
            assert self.now - begin_s < 60
        self.sequence += 1
        if isinstance(reply.payload, Refused):
            return Refusal(reply.payload.reason), self.now - begin_s
        assert isinstance(reply.payload, Authenticated)
        self.sealer = Sealer.derive(reply.payload.session, secret, asked.nonce, nonce)
        return Refusal.NONE, self.now - begin_s

    def trust(self, address: str = HOST, span: int = TRUST_ALWAYS) -> None:
        self.lib.host_wire_trust(self.wire, number(address), span)

    def of_type(self, kind: Type, address: str = HOST) -> list[Sent]:
        return [sent for sent in self.sent if sent.data[5] == kind and sent.address == address]

    @property
    def status(self) -> Status:
        """The newest report."""
        newest = [sent for sent in self.of_type(Type.STATUS) if sent.port == STATUS_PORT][-1]
        status = newest.packet.payload
        assert isinstance(status, Status)
        return status
