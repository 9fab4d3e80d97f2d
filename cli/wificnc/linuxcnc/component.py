"""The HAL component: pins of LinuxCNC on one side, a stream of segments to a controller on the other."""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from wificnc.errors import UserError
from wificnc.linuxcnc.slices import AXES, CommandError, Slicer
from wificnc.wmc3.device import Device, find_key
from wificnc.wmc3.layout import Estop, IoControl, JogStop, Ping, Pong, Reset, State, Status, StreamAck, StreamClose
from wificnc.wmc3.stream import StreamSender

TICK_S = 0.01
OUTPUTS_S = 0.1  # outputs are said again this often: a datagram may be lost
PING_S = 5.0
RETRY_S = 1.0
SILENT_S = 1.0  # without a status for so long the controller is gone
OUTPUT_COUNT = 5
TOP_SPEED_KEY = find_key("max_rate_mm_min.x")[0]  # steps/s on the wire


class Pins:
    """The component's pins. hal: LinuxCNC's module."""

    def __init__(self, hal: Any, name: str, joints: int) -> None:
        self.component = hal.component(name)
        add = self.component.newpin
        for joint in range(joints):
            prefix = f"joint.{joint}"
            add(f"{prefix}.position-cmd", hal.HAL_FLOAT, hal.HAL_IN)
            add(f"{prefix}.position-fb", hal.HAL_FLOAT, hal.HAL_OUT)
            add(f"{prefix}.scale", hal.HAL_FLOAT, hal.HAL_IN)
            add(f"{prefix}.limit", hal.HAL_BIT, hal.HAL_OUT)
            self.component[f"{prefix}.scale"] = 1.0
        for pin in ("enable", "estop", "reset", "spindle-on", "spindle-reverse", "flood", "mist"):
            add(pin, hal.HAL_BIT, hal.HAL_IN)
        for pin in ("connected", "ready", "fault", "estopped", "probe"):
            add(pin, hal.HAL_BIT, hal.HAL_OUT)
        for number in range(OUTPUT_COUNT):
            add(f"digital-out-{number:02}", hal.HAL_BIT, hal.HAL_IN)
        add("servo-time", hal.HAL_FLOAT, hal.HAL_IN)
        add("spindle-rpm", hal.HAL_FLOAT, hal.HAL_IN)
        add("queue-ms", hal.HAL_FLOAT, hal.HAL_OUT)
        for pin in ("underruns", "datagrams"):
            add(pin, hal.HAL_U32, hal.HAL_OUT)
        self.joints = range(joints)

    def __getitem__(self, name: str) -> Any:
        return self.component[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self.component[name] = value

    def ready(self) -> None:
        self.component.ready()

    def sample(self) -> tuple[float, list[float]]:
        """Servo time and commanded positions of one servo period. The servo thread may run meanwhile: look again."""
        while True:
            before = self["servo-time"]
            positions = [self[f"joint.{joint}.position-cmd"] for joint in self.joints]
            if self["servo-time"] == before:
                return before, positions

    def outputs(self) -> IoControl:
        """What LinuxCNC wants of spindle, coolant and outputs."""
        rpm = min(abs(self["spindle-rpm"]), 65535)
        return IoControl(
            misc_outputs=sum(bool(self[f"digital-out-{n:02}"]) << n for n in range(OUTPUT_COUNT)),
            spindle=(2 if self["spindle-reverse"] else 1) if self["spindle-on"] else 0,
            rpm=round(rpm) if rpm == rpm else 0,
            coolant=bool(self["flood"]) | bool(self["mist"]) << 1,
        )


class Link:
    """One controller: connects, keeps pins and device together, every tick."""

    def __init__(self, pins: Pins, device: Device, level_s: float) -> None:
        self.pins = pins
        self.device = device
        self.level_s = level_s
        self.slicer: Slicer | None = None
        self.sender: StreamSender | None = None
        self.status: Status | None = None
        self.queued_s = 0.0
        now = time.monotonic()
        self.sampled_s = 0.0  # servo time
        self.heard = self.moved = now
        self.said_at = self.pinged = float("-inf")
        self.said = IoControl()
        self.was_estop = self.was_reset = self.was_enabled = False
        device.handshake()
        device.listen()
        device.post(JogStop(axis=0xFF))

    def tick(self) -> None:
        """Raises UserError when the controller is gone."""
        now = time.monotonic()
        self._hear(now)
        self._stop_and_reset()
        if self.status:
            self._move(now)
        self._say_outputs(now)
        if now - self.pinged >= PING_S:
            self.device.request(Ping(), Pong)
            self.pinged = now

    def end(self) -> None:
        """Nothing more comes. What is queued is executed."""
        if self.sender:
            self.device.command(StreamClose(self.sender.stream))
        self.sender = None

    # ---- hearing ----

    def _hear(self, now: float) -> None:
        for payload in self.device.heard():
            if isinstance(payload, Status):
                self.heard, self.status = now, payload
            elif isinstance(payload, StreamAck) and self.sender:
                self.queued_s = payload.queued_us / 1e6
                self._take(payload)
        if now - self.heard > SILENT_S:
            raise UserError("the controller is silent")
        if self.status:
            self._show(self.status)

    def _take(self, ack: StreamAck) -> None:
        assert self.sender
        try:
            self.sender.take(ack)
        except UserError as err:
            self._fault(err.message)

    def _fault(self, why: str) -> None:
        """Motion has ended: reset, and enable anew."""
        print(f"wificnc: {why}", file=sys.stderr)
        self.pins["fault"] = True
        self.sender = None

    def _show(self, status: Status) -> None:
        pins = self.pins
        for joint in pins.joints:
            scale = pins[f"joint.{joint}.scale"] or 1.0
            pins[f"joint.{joint}.position-fb"] = status.position_steps[joint] / scale
            pins[f"joint.{joint}.limit"] = bool(status.limits >> joint & 1)
        pins["connected"] = True
        pins["estopped"] = status.state in (State.ALARM, State.ESTOP)
        pins["ready"] = not pins["estopped"] and not pins["fault"]
        pins["probe"] = bool(status.probe)
        pins["queue-ms"] = 1e3 * self.queued_s
        if self.sender:
            pins["underruns"], pins["datagrams"] = self.sender.underruns, self.sender.sent

    # ---- commanding ----

    def _stop_and_reset(self) -> None:
        estop, reset = bool(self.pins["estop"]), bool(self.pins["reset"])
        if estop:
            for _ in range(1 if self.was_estop else 3):  # and every tick as long as it is
                self.device.post(Estop())
        if reset and not self.was_reset:
            self.pins["fault"] = False
            if self.status and self.status.state in (State.ALARM, State.ESTOP):
                self.device.command(Reset())
        self.was_estop, self.was_reset = estop, reset

    def _say_outputs(self, now: float) -> None:
        outputs = self.pins.outputs()
        if outputs != self.said or now - self.said_at >= OUTPUTS_S:
            self.device.post(outputs)
            self.said, self.said_at = outputs, now

    def _begin(self, status: Status) -> None:
        scales = [self.pins[f"joint.{joint}.scale"] for joint in self.pins.joints]
        rates = [float(self.device.get(TOP_SPEED_KEY + joint)) for joint in self.pins.joints]
        self.slicer = Slicer(scales, self.level_s, rates)
        self.sender = self.device.open_stream()
        self.sender.put([self.slicer.begin(status.position_steps)])
        self.sampled_s, _ = self.pins.sample()
        self.moved = time.monotonic()
        self.queued_s = self.level_s

    def _sample(self, sender: StreamSender, slicer: Slicer) -> None:
        """The time is that of the positions, however late this program gets its turn."""
        now_s, positions = self.pins.sample()
        if now_s == self.sampled_s:
            if time.monotonic() - self.moved > SILENT_S:
                self._fault("servo-time stands still: connect it, as docs/linuxcnc.md shows")
            return
        self.moved = time.monotonic()
        try:
            sender.put([slicer.slice(positions, now_s - self.sampled_s, self.queued_s)])
        except CommandError as err:
            self._fault(str(err))
        self.sampled_s = now_s

    def _move(self, now: float) -> None:
        enabled = bool(self.pins["enable"]) and bool(self.pins["ready"])
        assert self.status
        if enabled and not self.was_enabled and self.sender is None:
            self._begin(self.status)
        elif self.sender and self.slicer and enabled:
            self._sample(self.sender, self.slicer)
        elif self.sender and not enabled and self.sender.is_executed:
            self.end()
        self.was_enabled = enabled
        for payload, segments in self.sender.poll(now) if self.sender else ():
            self.device.post(payload, segments)


def run(pins: Pins, address: str, password: str, level_s: float) -> None:
    """Connect, and connect again whenever the controller was gone. Ends by KeyboardInterrupt."""
    while True:
        try:
            with Device(address, password, timeout_s=0.5) as device:
                link = Link(pins, device, level_s)
                due = time.monotonic()
                while True:
                    link.tick()
                    due = max(due + TICK_S, time.monotonic())
                    time.sleep(max(0.0, due - time.monotonic()))
        except UserError as err:
            print(f"wificnc: {err.message}", file=sys.stderr)
            pins["fault"] = bool(pins["fault"] or pins["enable"])
            for pin in ("connected", "ready"):
                pins[pin] = False
            time.sleep(RETRY_S)


def main(argv: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python3 -m wificnc.linuxcnc", description=__doc__)
    parser.add_argument("--name", default="wificnc", help="of the component, and before its pins; one for each device")
    parser.add_argument("--address", required=True, help="IPv4 address of the controller")
    parser.add_argument("--password", default="", help="where the controller wants one")
    parser.add_argument("--joints", type=int, choices=range(1, AXES + 1), default=3)
    parser.add_argument("--queue-ms", type=float, default=100.0, help="motion that waits in the controller")
    asked = parser.parse_args(argv)
    try:
        hal = importlib.import_module("hal")
    except ImportError:
        print("LinuxCNC is not here: its Python module hal comes with linuxcnc-uspace", file=sys.stderr)
        return 1
    pins = Pins(hal, asked.name, asked.joints)
    pins.ready()
    with suppress(KeyboardInterrupt):
        run(pins, asked.address, asked.password, asked.queue_ms / 1e3)
    return 0
