"""LinuxCNC's servo thread, the component and a controller in virtual time. Only LinuxCNC itself is not there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TypeVar

from wificnc.errors import LinkError, RefusedError
from wificnc.linuxcnc.link import Link
from wificnc.linuxcnc.pins import Pins
from wificnc.wmc3.layout import Ack, Handshake, HandshakeResponse, Refused, Segment, StreamOpen, StreamOpened, Type
from wificnc.wmc3.packet import Packet
from wificnc.wmc3.packing import Layout
from wificnc.wmc3.stream import StreamSender
from wire_device import HOST
from wire_device import Device as VirtualDevice

LayoutT = TypeVar("LayoutT", bound=Layout)
SERVO_S = 0.001


class FakeHal:
    """As much of LinuxCNC's module hal as Pins needs."""

    HAL_BIT = HAL_FLOAT = HAL_S32 = HAL_U32 = HAL_IN = HAL_OUT = HAL_IO = 0

    class component(dict):
        def __init__(self, name: str) -> None:
            super().__init__()
            self.is_ready = False

        def newpin(self, name: str, *_: object) -> None:
            assert name not in self
            self[name] = 0

        def ready(self) -> None:
            self.is_ready = True


class Wire:
    """wificnc.wmc3.device.Device, over the virtual device's queue instead of sockets."""

    def __init__(self, virtual: VirtualDevice) -> None:
        self.virtual = virtual
        self.client = virtual.connect()
        self.dead = False
        self.requests: list[Layout] = []
        self.loses_status = False
        self.status_late_s = 0.0  # status reports take so long, all else no time

    def handshake(self) -> HandshakeResponse:
        return self.request(Handshake(0x01000000, "test"), HandshakeResponse)

    def listen(self, alone: bool = True) -> None:
        assert not alone, "another component may listen to another device"

    def post(self, payload: Layout, segments: tuple[Segment, ...] = ()) -> None:
        if not self.dead:
            self.virtual.send(payload, tuple(segments), HOST)

    def request(self, payload: Layout, reply: type[LayoutT]) -> LayoutT:
        if self.dead:
            raise LinkError("it does not answer")
        self.requests.append(payload)
        answer = self.virtual.request(self.client, payload).payload
        if isinstance(answer, Refused):
            raise RefusedError(f"refused: {answer.reason}")
        assert isinstance(answer, reply)
        return answer

    def command(self, payload: Layout) -> None:
        self.request(payload, Ack)

    def get(self, key: int) -> int:
        return 20_000

    def open_stream(self) -> StreamSender:
        opened = self.request(StreamOpen(), StreamOpened)
        if opened.refusal:
            raise RefusedError(f"refused: {opened.refusal}")
        return StreamSender(opened.stream, opened.capacity)

    def heard(self) -> Iterator[Packet]:
        sent, self.virtual.sent = self.virtual.sent, []
        for each in sent if not self.dead else ():
            if each.data[5] == Type.STATUS and self.loses_status:
                continue
            if each.data[5] == Type.STATUS and each.time_s + self.status_late_s > self.virtual.now:
                self.virtual.sent.append(each)
            else:
                yield each.packet


class Bench:
    """Time goes on by run(); `command` says what LinuxCNC commands at a time."""

    def __init__(self, virtual: VirtualDevice, joints: int = 3, scale: float = 200.0, level_s: float = 0.1) -> None:
        self.virtual = virtual
        self.wire = Wire(virtual)
        self.pins = Pins(FakeHal, "wificnc", joints)
        self.periods = 0
        self.command: list[float] = [0.0] * joints
        self.each_servo: Callable[[], None] = lambda: None
        for joint in range(joints):
            self.pins[f"joint.{joint}.scale"] = scale
        self.link = Link(self.pins, self.wire, level_s, clock=lambda: virtual.now)  # type: ignore[arg-type]

    def run(self, seconds: float) -> None:
        """Servo periods, and a tick of the component every tenth."""
        for _ in range(round(seconds / SERVO_S)):
            self.servo()
            self.link.follow_spindle()
            self.periods += 1
            if self.periods % 10 == 0:
                self.link.tick()

    def run_to(self, condition: Callable[[], bool], most_s: float = 30.0) -> None:
        end = self.virtual.now + most_s
        while not condition():
            assert self.virtual.now < end, "it takes too long"
            self.run(0.01)

    def servo(self) -> None:
        self.virtual.run(SERVO_S)
        self.each_servo()
        for joint, position in enumerate(self.command):
            self.pins[f"joint.{joint}.position-cmd"] = position
        self.pins["servo-time"] += SERVO_S

    def enable(self) -> None:
        self.run(0.1)
        self.pins["enable"] = True
        self.run(0.05)
        assert self.link.sender and not self.pins["fault"]

    @property
    def feedback(self) -> list[float]:
        return [self.pins[f"joint.{joint}.position-fb"] for joint in self.pins.joints]


def mover(bench: Bench, joint: int, target: float, speed: float, accel: float = 400.0) -> Callable[[], None]:
    """A trapezoid of one joint, one servo period a call."""
    start = bench.command[joint]
    way, begun = target - start, bench.pins["servo-time"]
    size = abs(way)
    speed = min(speed, math.sqrt(size * accel))
    up_s = speed / accel
    total_s = size / speed + up_s

    def step() -> None:
        t = min(bench.pins["servo-time"] - begun, total_s)
        if t < up_s:
            done = accel * t * t / 2
        elif t > total_s - up_s:
            done = size - accel * (total_s - t) ** 2 / 2
        else:
            done = speed * (t - up_s / 2)
        bench.command[joint] = start + math.copysign(done, way)

    return step
