"""One controller: pins and device are kept together, every tick. Loop and clock are the caller's."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from wificnc.errors import UserError
from wificnc.linuxcnc.pins import INPUT_COUNT, Pins
from wificnc.linuxcnc.slices import CommandError, Slicer
from wificnc.linuxcnc.spindle import AtSpeed, Encoder
from wificnc.linuxcnc.touch import Clearance
from wificnc.wmc3.device import Device, find_key
from wificnc.wmc3.layout import (
    Capability,
    Estop,
    Home,
    IoControl,
    JogStop,
    Ping,
    Pong,
    ProbeLast,
    ProbeResult,
    Refusal,
    Reset,
    Segment,
    SegmentFlag,
    State,
    Statistics,
    StatisticsResponse,
    Status,
    StatusFlag,
    StreamAck,
    StreamClose,
)
from wificnc.wmc3.stream import StreamSender

OUTPUTS_S = 0.1  # outputs are said again this often: a datagram may be lost
PING_S = 5.0
SILENT_S = 1.0  # without a status for so long the controller is gone
SEEN_S = 0.005  # of servo time: the servo thread has run and seen the pins
LOOKS_MOST = 100_000  # for the servo thread to run: some 10 ms
HOMING_BEGINS_S = 1.0  # after the order
LAST_US = 1000  # behind the last motion
FAR_S = 0.25  # so much time at top speed from where the machine stands, and the command is a mistake
TOP_SPEED_KEY = find_key("max_rate_mm_min.x")[0]  # steps/s on the wire
LOCKED = (State.ALARM, State.ESTOP)


class Task(Protocol):
    """What is under way instead of following commands."""

    def follow(self, link: Link) -> bool:
        """@return True when it is over. Raises UserError when it failed."""


class Homing:
    """The controller looks for its own switches. LinuxCNC believes that it waits for an index pulse; when that comes,
    it takes position-fb as where the joints are."""

    def __init__(self, joints: int) -> None:
        self.joints = joints
        self.asked_s: float | None = None
        self.seen = self.finished = False

    def follow(self, link: Link) -> bool:
        if self.asked_s is None:
            if not self.finished:
                link.finish()
                self.finished = True
            if (link.sender and not link.sender.is_executed) or not link.stands:
                return False
            link.end()
            link.device.command(Home(axes=self.joints))
            self.asked_s = link.now
            return False
        assert link.status
        self.seen |= link.status.state == State.HOMING
        begins = not self.seen and link.now - self.asked_s < HOMING_BEGINS_S
        if begins or link.status.state == State.HOMING or not link.stands:
            return False
        homed = link.device.request(Statistics(), StatisticsResponse).homed
        if link.status.state in LOCKED or homed & self.joints != self.joints:
            raise UserError("the controller has not found its switches")
        link.begin()
        link.wait_for_servo()
        link.pins.show_positions(link.status.position_steps)
        for joint in link.pins.joints:
            link.pins[f"joint.{joint}.index-enable"] = False
        link.settle()
        return True


class Touched:
    """The probe has stopped the machine. LinuxCNC takes the feedback at which its probe input rises: that is the
    contact, exact to the step. When its own motion has ended, too, commands are followed again."""

    def __init__(self, contact: tuple[int, ...]) -> None:
        self.contact = contact
        self.clearance: Clearance | None = None
        self.into: list[float] = []  # the way of LinuxCNC's command behind the contact; its length is 1
        self.deepest = 0.0

    def follow(self, link: Link) -> bool:
        if self.clearance is None:
            self.clearance = self._begin(link)
            return False
        if not link.is_settled:
            return False
        touched, command = link.pins.positions(self.contact), link.pins.sample()[1]
        link.settle()
        depth = sum((asked - at) * way for asked, at, way in zip(command, touched, self.into, strict=True))
        if depth > self.deepest:
            self.deepest = depth
            self.clearance.begin(touched, command)
            return False
        self.clearance.follow(command)
        if not link.stands:
            return False
        assert link.status
        link.begin()
        self.clearance.shift(touched, link.pins.positions(link.status.position_steps))
        link.clearance = self.clearance
        return True

    def _begin(self, link: Link) -> Clearance:
        link.pins.show_positions(self.contact)
        link.pins["probe"] = True
        link.settle()
        touched, command = link.pins.positions(self.contact), link.pins.sample()[1]
        self.deepest = math.dist(command, touched)
        self.into = [(asked - at) / (self.deepest or 1.0) for asked, at in zip(command, touched, strict=True)]
        clearance = Clearance(len(command))
        clearance.begin(touched, command)
        return clearance


class Link:
    """Raises UserError where the controller is gone; the caller connects anew."""

    def __init__(
        self,
        pins: Pins,
        device: Device,
        level_s: float,
        run_up_s: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.pins = pins
        self.device = device
        self.level_s = level_s
        self.clock = clock
        self.now = clock()
        self.slicer: Slicer | None = None
        self.sender: StreamSender | None = None
        self.task: Task | None = None
        self.clearance = Clearance(len(pins.joints))
        self.status: Status | None = None
        self.queued_s = 0.0
        self._watches = self._was_probing = self._begins = False  # watches: a contact is to come, and exactly
        self._watched = 0  # end of the segments that watch for it
        self._status_us = 0  # device's clock
        self._closed_us: int | None = None
        self._sampled_s = self._settled_s = 0.0  # servo time
        self._heard = self._moved = self.now
        self._said_at = self._pinged = float("-inf")
        self._said = IoControl()
        self._was_estop = self._was_reset = self._was_enabled = False
        hello = device.handshake()
        self._results = device.request(ProbeLast(), ProbeResult).number
        self.encoder = Encoder() if hello.capabilities & Capability.ENCODER else None
        self.at_speed = AtSpeed(run_up_s)
        device.listen(alone=False)
        device.post(JogStop(axis=0xFF))

    def tick(self) -> None:
        """Every 10 ms."""
        self.now = self.clock()
        self._hear()
        self._stop_and_reset()
        if self.status:
            self._move(self.status)
        for payload, segments in self.sender.poll(self.now) if self.sender else ():
            self.device.post(payload, segments)
        self.follow_spindle()
        self._say_outputs()
        if self.now - self._pinged >= PING_S:
            self.device.request(Ping(), Pong)
            self._pinged = self.now

    def follow_spindle(self) -> None:
        """The pins of the encoder; may be called more often."""
        pins, now = self.pins, self.clock()
        if not self.status:
            return
        wanted = (self._said.spindle, self._said.rpm)
        if self.encoder:
            turns, armed = self.encoder.update(now, bool(pins["spindle-index-enable"]))
            pins["spindle-revs"], pins["spindle-speed-rps"] = turns, self.encoder.speed_rps
            if not armed and pins["spindle-index-enable"]:
                pins["spindle-index-enable"] = False
        else:
            pins["spindle-speed-rps"] = (-1 if self.status.spindle == 2 else 1) * self.status.rpm / 60
        pins["spindle-at-speed"] = self.at_speed.update(now, wanted, self.status, self.encoder)

    def finish(self) -> None:
        """Nothing more comes for now."""
        if self.sender:
            self.sender.put([Segment(duration_us=LAST_US)], last=True)

    def end(self) -> None:
        """Nothing more comes. What is queued is executed."""
        if self.sender:
            self.device.command(StreamClose(self.sender.stream))
        self.sender = None

    # ---- for tasks ----

    @property
    def stands(self) -> bool:
        """The newest report is newer than the end of the last stream, and nothing moves."""
        if not self.status or (self._closed_us is not None and not _is_later(self._status_us, self._closed_us)):
            return False
        return not self.status.flags & StatusFlag.MOVING and self.status.state not in (State.RUN, State.PROBING)

    def settle(self) -> None:
        """Commands are looked at when the servo thread has seen the pins as they are now."""
        self._settled_s = self.pins["servo-time"] + SEEN_S

    @property
    def is_settled(self) -> bool:
        return bool(self.pins["servo-time"] >= self._settled_s)

    def wait_for_servo(self) -> None:
        """Until the servo thread has just run: then there is time for several pins before it looks at them again."""
        before = self.pins["servo-time"]
        for _ in range(LOOKS_MOST):
            if self.pins["servo-time"] != before:
                return

    def begin(self) -> None:
        """A stream from where the machine stands."""
        assert self.status
        rates = [float(self.device.get(TOP_SPEED_KEY + joint)) for joint in self.pins.joints]
        self.slicer = Slicer(self.pins.scales, self.level_s, rates)
        self.sender = self.device.open_stream()
        self.sender.put([self.slicer.begin(self.status.position_steps)])
        self._sampled_s, command = self.pins.sample()
        self.clearance = Clearance(len(command))
        self._begins = True
        self._moved = self.clock()
        self.queued_s = self.level_s

    # ---- hearing ----

    def _hear(self) -> None:
        for packet in self.device.heard():
            payload, at_us = packet.payload, packet.header.timestamp_us
            if isinstance(payload, Status):
                self._heard = self.now
                if not self.status or _is_later(at_us, self._status_us):
                    self.status, self._status_us = payload, at_us
                if self.encoder:
                    self.encoder.take(at_us, self.now, payload)
            elif isinstance(payload, StreamAck) and self.sender and payload.stream == self.sender.stream:
                self.queued_s = payload.queued_us / 1e6
                self._take(payload, at_us)
        if self.now - self._heard > SILENT_S:
            raise UserError("the controller is silent")
        if self.status:
            self._show(self.status)

    def _take(self, ack: StreamAck, at_us: int) -> None:
        assert self.sender
        try:
            self.sender.take(ack)
        except UserError as err:
            self._closed_us = at_us
            contact = self._contact() if ack.refusal == Refusal.STREAM_CLOSED else None
            self._watches = False
            self.sender = None
            if contact:
                self.task = Touched(contact)
            else:
                self._fault(err.message)

    def _contact(self) -> tuple[int, ...] | None:
        """Where the probe has touched in this G38; None: it has not."""
        result = self.device.request(ProbeLast(), ProbeResult)
        known, self._results = self._results, result.number
        return result.position_steps if result.contact and result.number != known else None

    def _fault(self, why: str) -> None:
        """Motion has ended: reset, and enable anew."""
        print(f"wificnc: {why}", file=sys.stderr)
        self.pins["fault"] = True
        self.task = None
        if self.sender:
            self.end()

    def _show(self, status: Status) -> None:
        pins = self.pins
        for joint in pins.joints:
            pins[f"joint.{joint}.limit"] = bool(status.limits >> joint & 1)
            pins[f"joint.{joint}.home-switch"] = bool(status.home_switches >> joint & 1)
        for number in range(INPUT_COUNT):
            pins[f"digital-in-{number:02}"] = bool(status.misc_inputs >> number & 1)
            pins[f"digital-in-{number:02}-not"] = not status.misc_inputs >> number & 1
        if self.task is None:
            pins.show_positions(status.position_steps)
        if self.task is None and not self._watches:
            pins["probe"] = bool(status.probe)
        pins["connected"] = True
        pins["homing"] = isinstance(self.task, Homing)
        pins["estopped"] = status.state in LOCKED
        pins["estop-ok"] = not pins["estopped"]
        pins["ready"] = not pins["estopped"] and not pins["fault"]
        pins["queue-ms"] = 1e3 * self.queued_s if self.sender else 0.0
        if self.sender:
            pins["underruns"], pins["datagrams"] = self.sender.underruns, self.sender.sent

    # ---- commanding ----

    def _stop_and_reset(self) -> None:
        estop, reset = bool(self.pins["estop"]), bool(self.pins["reset"])
        if estop:
            for _ in range(1 if self._was_estop else 3):  # and every tick as long as it is
                self.device.post(Estop())
        if reset and not self._was_reset:
            self.pins["fault"] = False
            if self.status and self.status.state in LOCKED:
                self.device.command(Reset())
        self._was_estop, self._was_reset = estop, reset

    def _say_outputs(self) -> None:
        outputs = self.pins.outputs()
        if outputs != self._said or self.now - self._said_at >= OUTPUTS_S:
            self.device.post(outputs)
            self._said, self._said_at = outputs, self.now

    def _move(self, status: Status) -> None:
        enabled = bool(self.pins["enable"]) and bool(self.pins["ready"])
        if self.task and not enabled:
            if self.pins["enable"]:
                self._fault(f"the controller has stopped by itself: {State(status.state).name.lower()} {status.alarm}")
            self.task = None
        if self.task:
            self._follow_task(self.task)
        elif enabled and not self._was_enabled and self.sender is None and self.stands:
            self._watches = False
            try:
                self.begin()
            except UserError as err:
                self._fault(err.message)
        elif self.sender and enabled:
            self._look_for_tasks(status)
            self._sample(self.sender)
        elif self.sender and self.sender.is_executed:
            self.end()
            self._watches = False
        self._was_enabled = enabled and (self._was_enabled or self.sender is not None)

    def _follow_task(self, task: Task) -> None:
        try:
            if task.follow(self):
                self.task = None
        except UserError as err:
            self._fault(err.message)

    def _look_for_tasks(self, status: Status) -> None:
        probing = self.pins.is_probing
        assert self.sender
        if probing and not self._was_probing:
            self._watches = not status.probe  # G38.4, G38.5 look for the opposite
            self._watched = self.sender.end
        self._was_probing = probing
        self._watches = self._watches and (probing or self.sender.done < self._watched)
        if joints := self.pins.index_enables:
            self.task = Homing(joints)

    def _sample(self, sender: StreamSender) -> None:
        """The time is that of the positions, however late this program gets its turn."""
        assert self.slicer
        now_s, command = self.pins.sample()
        if self.task or not self.is_settled:
            return
        if now_s == self._sampled_s:
            if self.clock() - self._moved > SILENT_S:
                self._fault("servo-time stands still: connect it, as docs/linuxcnc.md shows")
            return
        self._moved = self.clock()
        try:
            seconds = now_s - self._sampled_s
            positions = self.clearance.follow(command)
            if self._begins:
                self.slicer.check(positions, FAR_S)
            self._begins = False
            segment = self.slicer.slice(positions, seconds, self.queued_s)
            if self._watches and self._was_probing:
                segment, self._watched = replace(segment, flags=SegmentFlag.PROBE), sender.end + 1
            sender.put([segment])
        except CommandError as err:
            self._fault(str(err))
        self._sampled_s = now_s


def _is_later(one_us: int, other_us: int) -> bool:
    """Of a clock that wraps after 32 bits."""
    return 0 < (one_us - other_us) & 0xFFFFFFFF < 1 << 31
