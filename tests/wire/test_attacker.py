"""An attacker who knows WMC3 but not the key: from its own address, with the owner's forged, with seals made up and
datagrams played again, over connections of its own. Nothing steps, switches, is set, or changes its owner."""

from __future__ import annotations

import socket
import struct

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from test_motion import segment
from test_requests import configure
from wificnc.connection.wmc3.layout import (
    Authenticate,
    Challenge,
    ConfigGet,
    ConfigSave,
    ConfigSet,
    Estop,
    Handshake,
    Hold,
    Home,
    IoControl,
    Jog,
    JogStop,
    Motion,
    Ping,
    ProbeLast,
    Refusal,
    Reset,
    Resume,
    Statistics,
    StatisticsResponse,
    StreamClose,
    StreamDrop,
    StreamOpen,
    StreamSegments,
    Take,
    ValueType,
)
from wificnc.connection.wmc3.packet import build
from wificnc.connection.wmc3.packing import Layout
from wire_device import HOST, OTHER, Device

KEY = "k7qf3-x2m9d-0abcd-efghj"
SEAL_SIZE = 16
VALUE = struct.pack("<H", 20).ljust(64, b"\0")
WATCHER = "10.0.0.9"
KEYS = (0x0001, 0x0103, 0x0800, 0x0801, 0x0802)
REQUESTS: tuple[Layout, ...] = (
    Handshake(), ConfigSave(), ConfigGet(key=1), ConfigSet(key=0x0103, value_type=ValueType.U16, value=VALUE), Ping(1),
    StreamOpen(), StreamClose(1), StreamDrop(1), Take(1), Take(0), Statistics(), ProbeLast(), Challenge(),
    Authenticate(bytes(16), bytes(32)), Jog(0, 1, 1000), JogStop(0), Estop(), Hold(), Resume(), Reset(), Home(1),
    IoControl(spindle=1, rpm=1000, coolant=3, misc_outputs=31),
)  # fmt: skip
DATAGRAMS: tuple[tuple[Layout, int], ...] = (
    (Motion(count=8), 8), (Motion(count=1), 1), (Jog(0, 1, 1000), 0), (JogStop(0xFF), 0), (Estop(), 0), (Hold(), 0),
    (Resume(), 0), (Reset(), 0), (Home(1), 0), (IoControl(spindle=1, rpm=1000, coolant=3, misc_outputs=31), 0),
    (StreamSegments(1, 0, 8), 8), (StreamSegments(0, 0, 1), 1),
)  # fmt: skip
ADDRESSES = st.sampled_from([HOST, OTHER])
NUMBERS = st.integers(0, 2**32 - 1) | st.integers(0, 100)


class Attack(RuleBasedStateMachine):
    """The owner has moved, switched an output on and is still connected, or has gone."""

    def __init__(self) -> None:
        super().__init__()
        self.device = Device(key=KEY, settings={78: 0})  # the watcher takes numbers of its sequence
        self.overheard: list[bytes] = []
        self.connections: list[int] = []

    def teardown(self) -> None:
        self.device.close()

    @initialize(stays=st.booleans())
    def own(self, stays: bool) -> None:
        device = self.device
        client = device.connect()
        assert device.prove(client, KEY) == Refusal.NONE
        raw = device.raw

        def overhear(data: bytes, address: str = HOST, port: int = 40000) -> None:
            self.overheard.append(data)
            raw(data, address, port)

        device.raw = overhear  # type: ignore[method-assign]
        device.send(Motion(count=1), (segment(100),))
        device.send(IoControl(misc_outputs=1))
        device.send(Resume())
        device.send(Reset())
        device.raw = raw  # type: ignore[method-assign]
        device.run(1)
        assert device.pulses[0] == 100
        if not stays:
            device.disconnect(client)
            device.run(5)
        self.watcher = device.connect(WATCHER)
        self.before = self.seen()

    def seen(self) -> tuple[object, ...]:
        device = self.device
        values = tuple(device.request(self.watcher, ConfigGet(key=key)).payload for key in KEYS)
        outputs = device.outputs()
        return device.pulses, outputs.spindle_direction, outputs.coolant, outputs.digital, values

    @rule(
        which=st.sampled_from(DATAGRAMS), address=ADDRESSES, number=NUMBERS, at_us=NUMBERS, seal=st.binary(max_size=24)
    )
    def send(self, which: tuple[Layout, int], address: str, number: int, at_us: int, seal: bytes) -> None:
        payload, segments = which
        self.device.raw(build(payload, number, at_us, [segment(50)] * segments) + seal, address)

    @rule(which=st.integers(0, 3), address=ADDRESSES)
    def play_again(self, which: int, address: str) -> None:
        self.device.raw(self.overheard[which], address)

    @rule(which=st.integers(0, 3), bit=st.integers(0, 8 * 60), address=ADDRESSES)
    def change(self, which: int, bit: int, address: str) -> None:
        """Its seal stays, its sequence number or payload does not."""
        data = bytearray(self.overheard[which])
        data[bit // 8 % len(data)] ^= 1 << bit % 8
        self.device.raw(bytes(data), address)

    @rule(which=st.sampled_from(DATAGRAMS), of=st.integers(0, 3), number=NUMBERS)
    def borrow_a_seal(self, which: tuple[Layout, int], of: int, number: int) -> None:
        payload, segments = which
        packet = build(payload, number, 1, [segment(50)] * segments)
        self.device.raw(packet + self.overheard[of][-SEAL_SIZE:], HOST)

    @precondition(lambda self: len(self.connections) < 3)
    @rule()
    def connect(self) -> None:
        self.connections.append(self.device.connect(OTHER))

    @precondition(lambda self: self.connections)
    @rule()
    def leave(self) -> None:
        self.device.disconnect(self.connections.pop())

    @precondition(lambda self: self.connections)
    @rule(payload=st.sampled_from(REQUESTS), which=st.integers(0, 2))
    def ask(self, payload: Layout, which: int) -> None:
        device = self.device
        device.raw_request(self.connections[which % len(self.connections)], build(payload, device.sequence, 0))

    @precondition(lambda self: self.connections)
    @rule(which=st.integers(0, 2), proof=st.binary(min_size=32, max_size=32))
    def guess(self, which: int, proof: bytes) -> None:
        client = self.connections[which % len(self.connections)]
        self.device.raw_request(client, build(Challenge(), 1, 0))
        self.device.raw_request(client, build(Authenticate(bytes(16), proof), 2, 0))

    @rule(seconds=st.sampled_from([0.001, 0.05, 0.6, 3.0]))
    def wait(self, seconds: float) -> None:
        self.device.run(seconds)

    @invariant()
    def nothing_has_changed(self) -> None:
        if not hasattr(self, "before"):
            return
        self.device.run(0.01)
        assert self.seen() == self.before
        counts = self.device.request(self.watcher, Statistics()).payload
        assert isinstance(counts, StatisticsResponse)
        assert socket.inet_ntoa(bytes(counts.owner)) in (HOST, "0.0.0.0")


TestAttack = pytest.mark.slow(Attack.TestCase)
TestAttack.settings = settings(
    max_examples=60, stateful_step_count=30, deadline=None, suppress_health_check=list(HealthCheck)
)


def test_the_monitor_would_see_it() -> None:
    """What the invariant looks at does change by who has the key."""
    attack = Attack()
    try:
        attack.own(True)
        device = attack.device
        device.send(Motion(count=1), (segment(50),))
        device.send(IoControl(misc_outputs=3))
        device.run(1)
        now = attack.seen()
        assert now[0] != attack.before[0] and now[3] != attack.before[3]
        client = device.connect()
        assert device.prove(client, KEY) == Refusal.NONE
        device.run(5)
        configure(device, client, 0x0103, ValueType.U16, 25)
        assert attack.seen()[-1] != attack.before[-1]
    finally:
        attack.teardown()
