"""LinuxCNC's servo thread, the component and a controller in virtual time. Only LinuxCNC itself is not there."""

from __future__ import annotations

import ctypes
import math
import random
from collections.abc import Callable
from dataclasses import replace
from enum import IntEnum
from typing import Any

from component_library import AWAIT, MAKE_PIN, RANDOM, SAY, SEND, Options, Sample, World, library, numbered
from wificnc.connection.wmc3.layout import Status, Type
from wificnc.connection.wmc3.packet import Packet, build, crc16, parse
from wire_device import HOST
from wire_device import Device as VirtualDevice

SERVO_S = 0.001
SCALE = 200.0
SWITCHES = {22: 1, 23: 63, 27: 1, 130: 20, 131: 20, 132: 20, 133: 0, 134: 0, 135: 0}
PIN_TYPES = (ctypes.c_bool, ctypes.c_double, ctypes.c_uint32)


class MotionType(IntEnum):
    """motion.motion-type of LinuxCNC, motion(9)."""

    NONE = 0
    TRAVERSE = 1
    FEED = 2
    ARC = 3
    TOOL_CHANGE = 4
    PROBING = 5
    ROTARY_UNLOCK = 6


class Pins:
    """Pins in memory of ours, by name."""

    def __init__(self, handle: int, make: Callable[..., int]) -> None:
        """make: a function of the component that makes the pins of handle."""
        self.handle = handle
        self._values: dict[str, Any] = {}
        assert make(handle, MAKE_PIN(self._make), None) == 0

    def _make(self, _ctx: object, name: bytes, kind: int, _direction: int, at: int) -> int:
        assert name.decode() not in self._values
        value = self._values[name.decode()] = PIN_TYPES[kind]()
        ctypes.c_void_p.from_address(at).value = ctypes.addressof(value)
        return 0

    def __getitem__(self, name: str) -> Any:
        return self._values[name].value

    def __setitem__(self, name: str, value: float) -> None:
        self._values[name].value = value


class Wire:
    """The network between both: the component's sockets, over the virtual device's queue."""

    def __init__(self, virtual: VirtualDevice) -> None:
        self.virtual = virtual
        self.client = virtual.connect()
        self.dead = False
        self.requests: list[Packet] = []
        self.registration = b""  # the newest datagram that asks for reports
        self.is_slow = False  # answers wait until it is not
        self.clock_us = 0  # of the controller, later than it is
        self.is_mute = False  # requests are done and not answered
        self.loses_status = False
        self.shift_steps = 0  # by which reports are wrong on the first axis
        self.status_late_s = 0.0  # status reports take this time, all else no time
        self.answers: list[bytes] = []
        self.loss = 0.0  # part of all datagrams, both ways; so many come twice, too
        self.delay_s = 0.0  # each copy takes up to this, so they overtake one another
        self._to_device: list[tuple[float, bytes]] = []
        self._to_host: list[tuple[float, bytes]] = []
        self._dice = random.Random(1)

    def _shifted(self, packet: bytes) -> bytes:
        """With the time stamp of a controller that was switched on earlier."""
        if not self.clock_us or not packet:
            return packet
        changed = bytearray(packet)
        at_us = int.from_bytes(packet[12:16], "little") + self.clock_us
        changed[12:16] = (at_us % 2**32).to_bytes(4, "little")
        changed[16:18] = bytes(2)
        changed[16:18] = crc16(bytes(changed)).to_bytes(2, "little")
        return bytes(changed)

    def _copies(self) -> int:
        """Of a datagram that get there."""
        return (self._dice.random() >= self.loss) * (1 + (self._dice.random() < self.loss))

    def _on_way(self, message: bytes) -> list[tuple[float, bytes]]:
        """Its copies, and when each is there."""
        return [(self.virtual.now + self._dice.random() * self.delay_s, message) for _ in range(self._copies())]

    def _come(self, way: list[tuple[float, bytes]]) -> list[bytes]:
        come = sorted(each for each in way if each[0] <= self.virtual.now)
        way[:] = [each for each in way if each[0] > self.virtual.now]
        return [message for _, message in come]

    def deliver(self) -> None:
        """What is at the controller by now."""
        for message in self._come(self._to_device):
            self.virtual.raw(message, HOST)

    def datagram(self, _ctx: object, data: int, size: int) -> None:
        message = ctypes.string_at(data, size)
        if message[5] == Type.JOG_STOP:
            self.registration = message
        if not self.dead:
            self._to_device += self._on_way(message)
            self.deliver()

    def control(self, _ctx: object, data: int, size: int) -> None:
        """One message: the component asks for nothing in pieces."""
        message = ctypes.string_at(data, size)
        assert int.from_bytes(message[:2], "little") == size - 2
        packet = parse(message[2:])
        assert packet
        self.requests.append(packet)
        if self.dead:
            return
        reply = ctypes.create_string_buffer(512)
        count = self.virtual.lib.host_wire_request(self.virtual.wire, self.client, message[2:], size - 2, reply)
        self.virtual.fetch()
        if self.is_mute:
            return
        self.answers.append(count.to_bytes(2, "little") + self._shifted(reply.raw[:count]))

    def heard(self) -> list[bytes]:
        """Datagrams that come now."""
        sent, self.virtual.sent = self.virtual.sent, []
        come = []
        for each in sent if not self.dead else ():
            is_status = each.data[5] == Type.STATUS
            if is_status and self.loses_status:
                continue
            if is_status and self.shift_steps:
                status = each.packet.payload
                assert isinstance(status, Status)
                wrong = (status.position_steps[0] + self.shift_steps, *status.position_steps[1:])
                data = build(replace(status, position_steps=wrong), 0, each.packet.header.timestamp_us)
                come.append(data)
                continue
            if is_status and each.time_s + self.status_late_s > self.virtual.now:
                self.virtual.sent.append(each)
            else:
                self._to_host += self._on_way(self._shifted(each.data))
        return come + self._come(self._to_host)


class Bench:
    """Time advances by run(); `command` says what LinuxCNC commands at a time."""

    def __init__(
        self, virtual: VirtualDevice, joints: int = 3, scale: float = SCALE, level_s: float = 0.1, key: str = ""
    ) -> None:
        self.lib = library()
        self.virtual = virtual
        self.wire = Wire(virtual)
        self.joints = range(joints)
        self.pins = Pins(self.lib.component_pins(joints), self.lib.pins_make)
        self.options = Options(joints, level_s, 0.0, key.encode())
        self.said: list[str] = []
        self.lost: str | None = None
        self.status: Status | None = None  # the newest that came
        self.periods = 0
        self.is_held_up = False  # the component does not get its turn
        self.motion_type = MotionType.FEED
        self.samples_come = True
        self.servo_s = 1000.0
        self.command: list[float] = [0.0] * joints
        self.each_servo: Callable[[], None] = lambda: None
        self._samples: list[Sample] = []
        self._world = World(
            None,
            SEND(self.wire.datagram),
            SEND(self.wire.control),
            RANDOM(numbered),
            AWAIT(lambda _: None),
            SAY(self._say),
        )
        self.offset_s = 0.0  # of our clock against that of the controller
        self.link: int = self.lib.component_link()
        for joint in range(joints):
            self.pins[f"joint.{joint}.scale"] = scale
        self.connect()

    @property
    def is_probing(self) -> bool:
        return self.motion_type == MotionType.PROBING

    @is_probing.setter
    def is_probing(self, probes: bool) -> None:
        self.motion_type = MotionType.PROBING if probes else MotionType.NONE

    def _say(self, _ctx: object, text: bytes) -> None:
        self.said.append(text.decode())

    def connect(self) -> None:
        """A new connection, as after one that was lost."""
        self.lost = None
        self.lib.link_begin(self.link, self.pins.handle, self._world, self.options, self.now)

    @property
    def now(self) -> float:
        """The component's clock, s."""
        return self.virtual.now + self.offset_s

    def power_cycle(self, virtual: VirtualDevice, off_s: float = 1.0) -> None:
        """The controller was without power for this time; this is it afterwards, and the component finds it."""
        self.lib.link_lose(self.pins.handle)
        self.offset_s = self.now + off_s - virtual.now
        self.virtual = self.wire.virtual = virtual
        self.wire.client = virtual.connect()
        self.wire.answers.clear()
        self.connect()

    def press_reset(self) -> None:
        """As LinuxCNC's button: it leaves its e-stop, which ends faults."""
        self.pins["enable"] = False
        self.pins["estop"] = False
        self.pins["reset"] = True
        self.run(0.1)
        self.pins["reset"] = False
        self.run(0.1)

    def switch_on(self) -> None:
        """As LinuxCNC: its command is what the feedback was while it was off, and from now on its own."""
        self.command[:] = self.feedback
        self.each_servo = lambda: None
        self.pins["enable"] = True

    def run(self, seconds: float) -> None:
        """Servo periods, and a tick of the component every tenth."""
        for _ in range(round(seconds / SERVO_S)):
            self.servo()
            self.periods += 1
            if not self.is_held_up and self.lost is None:
                self._component()

    def _component(self) -> None:
        now, peer = self.now, self.lib.component_peer(self.link)
        for data in self.wire.heard():
            packet = parse(data)
            if packet and isinstance(packet.payload, Status):
                self.status = packet.payload
            self.lib.peer_hear_udp(peer, data, len(data), now)
        answers: list[bytes] = []
        if not self.wire.is_slow:
            answers, self.wire.answers = self.wire.answers, []
        for data in answers:
            self.lib.peer_hear_tcp(peer, data, len(data), now)
        self.lib.link_follow_spindle(self.link, now)
        if self.periods % 10:
            return
        samples, self._samples = self._samples, []
        for sample in samples:
            self.lib.link_sample(self.link, sample, now)
        if lost := self.lib.link_tick(self.link, now):
            self.lost = lost.decode()
            self.lib.link_lose(self.pins.handle)

    def run_to(self, condition: Callable[[], bool], most_s: float = 30.0) -> None:
        end = self.now + most_s
        while not condition():
            assert self.now < end, "it takes too long"
            self.run(0.01)

    def servo(self) -> None:
        self.virtual.run(SERVO_S)
        self.wire.deliver()
        self.each_servo()
        self.servo_s += SERVO_S
        command = (*self.command, *[0.0] * (6 - len(self.command)))
        if self.samples_come:
            self._samples.append(Sample(command, self.servo_s, self.motion_type))

    def enable(self) -> None:
        self.run(0.1)
        self.run_to(lambda: self.pins["connected"], 1)
        self.pins["enable"] = True
        self.run_to(lambda: self.is_open or self.pins["fault"], 1)
        self.run(0.05)
        assert self.is_open and not self.pins["fault"]

    @property
    def is_open(self) -> bool:
        """It has a stream."""
        return bool(self.lib.component_is_open(self.link))

    @property
    def feedback(self) -> list[float]:
        return [self.pins[f"joint.{joint}.position-fb"] for joint in self.joints]


class Feed:
    """A joint that LinuxCNC's program moves: it slows down and waits while feed-inhibit is true."""

    def __init__(self, bench: Bench, joint: int, target: float, speed: float, accel: float = 400.0) -> None:
        self.bench, self.joint, self.target, self.speed, self.accel = bench, joint, target, speed, accel
        self.v = 0.0
        bench.each_servo = self.step

    def step(self) -> None:
        left = self.target - self.bench.command[self.joint]
        slows = self.bench.pins["feed-inhibit"] or abs(left) <= self.v * self.v / (2 * self.accel) + self.v * SERVO_S
        self.v = max(0.0, self.v - self.accel * SERVO_S) if slows else min(self.speed, self.v + self.accel * SERVO_S)
        if abs(left) < 0.01 and not self.bench.pins["feed-inhibit"]:
            self.bench.command[self.joint], self.v = self.target, 0.0
        else:
            self.bench.command[self.joint] += math.copysign(min(self.v * SERVO_S, abs(left)), left)


def mover(bench: Bench, joint: int, target: float, speed: float, accel: float = 400.0) -> Callable[[], None]:
    """A trapezoid of one joint, one servo period a call."""
    start = bench.command[joint]
    way, begun = target - start, bench.servo_s
    size = abs(way)
    speed = min(speed, math.sqrt(size * accel))
    up_s = speed / accel
    total_s = size / speed + up_s

    def step() -> None:
        t = min(bench.servo_s - begun, total_s)
        if t < up_s:
            done = accel * t * t / 2
        elif t > total_s - up_s:
            done = size - accel * (total_s - t) ** 2 / 2
        else:
            done = speed * (t - up_s / 2)
        bench.command[joint] = start + math.copysign(done, way)

    return step


class G38:
    """What LinuxCNC does: it moves until its probe input rises, takes the feedback of that period, and slows down."""

    def __init__(self, bench: Bench, target: float, speed: float, accel: float = 400.0) -> None:
        self.bench, self.target, self.speed, self.accel = bench, target, speed, accel
        self.v = 0.0
        self.probed: list[float] | None = None
        bench.is_probing = True
        bench.each_servo = self.step

    def step(self) -> None:
        pins, dt = self.bench.pins, 0.001
        if pins["probe"] and self.probed is None:
            self.probed = self.bench.feedback
        left = self.bench.command[2] - self.target
        slows = self.probed is not None or left <= self.v * self.v / (2 * self.accel) + self.v * dt
        self.v = max(0.0, self.v - self.accel * dt) if slows else min(self.speed, self.v + self.accel * dt)
        self.bench.command[2] -= min(self.v * dt, max(left, 0.0))
        if self.v == 0.0:
            self.bench.is_probing = False


def homing_bench(make_bench: Callable[..., Bench]) -> Bench:
    bench = make_bench(settings=SWITCHES)
    for axis, low in enumerate((-1000, -500, -800)):
        bench.virtual.lib.virtual_travel(bench.virtual.host, axis, low, 9000)
    bench.enable()
    return bench


class HomeByIndex:
    """LinuxCNC's homing with HOME_USE_INDEX and no search: it creeps until index-enable falls, and then takes the
    feedback as where the joint is."""

    def __init__(self, bench: Bench, joints: list[int]) -> None:
        self.bench, self.left = bench, joints
        self.worst = 0.0
        for joint in joints:
            bench.pins[f"joint.{joint}.index-enable"] = True
        bench.each_servo = self.step

    def step(self) -> None:
        for joint in list(self.left):
            if not self.bench.pins[f"joint.{joint}.index-enable"]:
                self.bench.command[joint] = self.bench.feedback[joint]
                self.left.remove(joint)
            else:
                self.bench.command[joint] += 1e-6
        errors = [abs(at - asked) for at, asked in zip(self.bench.feedback, self.bench.command, strict=True)]
        self.worst = max(self.worst, *errors)
