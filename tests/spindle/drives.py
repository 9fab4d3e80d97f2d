"""Spindle drives as slaves of Modbus, each written from what is published of it (docs/spindles.md), and not from the
table that the controller has its frames from: registers, coils, and what they do to a motor.

A drive gets whole requests with the time at which they end, and returns its answers with the time at which they begin.
Faults are switched on by its fields.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field

Answer = tuple[float, bytes]  # begin s, bytes

CRC_POLYNOMIAL = 0xA001


def crc16(data: bytes) -> bytes:
    """Of Modbus, low byte first: bit by bit, as MODBUS over serial line V1.02, 6.2.2 describes it."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ CRC_POLYNOMIAL if crc & 1 else crc >> 1
    return struct.pack("<H", crc)


@dataclass
class Motor:
    """Turns at what the drive puts out, along a ramp."""

    poles: int = 2
    ramp_hz_s: float = 0.0  # 0: immediately
    slip: float = 0.0  # part of the speed that it is slower
    _from_hz: float = 0.0
    _to_hz: float = 0.0
    _from_s: float = 0.0

    def go(self, now_s: float, hz: float) -> None:
        """Signed: negative is counter-clockwise."""
        if hz != self._to_hz:
            self._from_hz, self._from_s, self._to_hz = self.hz(now_s), now_s, hz

    def hz(self, now_s: float) -> float:
        way = self._to_hz - self._from_hz
        if self.ramp_hz_s <= 0.0 or way == 0.0:
            return self._to_hz
        part = min(1.0, (now_s - self._from_s) * self.ramp_hz_s / abs(way))
        return self._from_hz + way * part

    def rpm(self, now_s: float) -> float:
        return self.hz(now_s) * 120.0 / self.poles * (1.0 - self.slip)


@dataclass
class Drive:
    """What all have in common: the line, and what can be wrong with it."""

    motor: Motor = field(default_factory=Motor)
    address: int = 1
    baud: int = 9600
    parity: int = 0  # 0 none, 1 even, 2 odd
    delay_s: float = 0.002  # from the end of a request to the answer
    silent: bool = False  # power off, or a cable that is cut
    damaged: int = 0  # so many answers to come have a wrong CRC; -1: all
    dropped: int = 0  # so many answers to come are not sent
    late_by_one: bool = False  # each answer is that of the request before
    echoes: bool = False  # the line returns what is sent
    log: list[tuple[float, bytes]] = field(default_factory=list)
    direction: int = 0
    set_hz: float = 0.0
    maximum_hz: float = 400.0
    ampere: float = 2.4
    _kept: bytes = b""

    def hear(self, end_s: float, frame: bytes, baud: int, parity: int) -> list[Answer]:
        """A request."""
        self.log.append((end_s, frame))
        echo: list[Answer] = [(end_s + 1e-6, frame)] if self.echoes else []
        understood = (baud, parity) == (self.baud, self.parity) and frame[-2:] == crc16(frame[:-2])
        if self.silent or not understood or frame[0] != self.address:
            return echo
        body = self.answer(end_s, frame[1:-2])
        if not body:
            return echo
        answer = bytes([self.address]) + body
        return [*echo, *self._faulty(end_s + self.delay_s, answer + crc16(answer))]

    def _faulty(self, begin_s: float, answer: bytes) -> Iterable[Answer]:
        if self.late_by_one:
            self._kept, answer = answer, self._kept
        if self.dropped:
            self.dropped -= 1
            return []
        if self.damaged:
            self.damaged -= 1
            answer = answer[:-1] + bytes([answer[-1] ^ 0x55])
        return [(begin_s, answer)] if answer else []

    def answer(self, now_s: float, body: bytes) -> bytes:
        """To a request between address and CRC; b"": none."""
        raise NotImplementedError

    def run(self, now_s: float, direction: int) -> None:
        self.direction = direction
        self.motor.go(now_s, direction * self.set_hz)

    def set_speed(self, now_s: float, hz: float) -> None:
        self.set_hz = min(hz, self.maximum_hz)
        self.motor.go(now_s, self.direction * self.set_hz)

    def commands(self) -> list[bytes]:
        """What was commanded, without address and CRC, and without readings."""
        return [frame[1:-2] for _, frame in self.log if self.is_command(frame[1:-2])]

    def is_command(self, body: bytes) -> bool:
        return body[0] in (0x05, 0x06, 0x10)


class ModbusDrive(Drive):
    """Function codes of Modbus on registers and coils."""

    count_bytes = 1  # of the count in the answer to a reading

    def answer(self, now_s: float, body: bytes) -> bytes:
        if len(body) < 5:
            return b""  # no request of Modbus
        function, register, value = struct.unpack(">BHH", body[:5])
        if function in (0x03, 0x04):
            values = [self.read(now_s, function, register + n) for n in range(value)]
            if any(one is None for one in values):
                return bytes([function | 0x80, 0x02])
            data = b"".join(struct.pack(">H", int(one or 0) & 0xFFFF) for one in values)
            return bytes([function]) + len(data).to_bytes(self.count_bytes, "big") + data
        if function == 0x10:
            good = self.write(now_s, function, register, struct.unpack(">H", body[6:8])[0])
            return body[:5] if good else bytes([function | 0x80, 0x02])
        good = function in (0x05, 0x06) and self.write(now_s, function, register, value)
        return body if good else bytes([function | 0x80, 0x01 if function not in (0x05, 0x06) else 0x02])

    def read(self, now_s: float, function: int, register: int) -> int | None:
        raise NotImplementedError

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        raise NotImplementedError


class HuanyangV1(Drive):
    """Function, count, data: functions 1 reads a parameter, 3 controls, 4 reads a status, 5 sets the frequency."""

    def answer(self, now_s: float, body: bytes) -> bytes:
        function, count, data = body[0], body[1], body[2:]
        assert count == len(data), body.hex()
        if function == 0x03:
            self.run(now_s, {0x01: 1, 0x11: -1, 0x08: 0}[data[0]])
            running = abs(self.motor.hz(now_s)) > 0
            return bytes([0x03, 0x01, (self.direction != 0) | (self.direction < 0) << 2 | running << 3])
        if function == 0x05:
            self.set_speed(now_s, int.from_bytes(data, "big") / 100)
            return body
        if function == 0x01:
            parameters = {5: self.maximum_hz * 100, 11: 0, 143: self.motor.poles, 144: 3000}
            return bytes([0x01, 0x03, data[0]]) + round(parameters[data[0]]).to_bytes(2, "big")
        assert function == 0x04, body.hex()
        value = {0: self.set_hz * 100, 1: abs(self.motor.hz(now_s)) * 100, 2: self.ampere * 10}[data[0]]
        return bytes([0x04, 0x03, data[0]]) + round(value).to_bytes(2, "big")

    def is_command(self, body: bytes) -> bool:
        return body[0] in (0x03, 0x05)


class H2a(ModbusDrive):
    """Speed in 0.01 % of the maximum, real speed in rpm; a count of two bytes (F9.05 = 0)."""

    count_bytes = 2

    def read(self, now_s: float, function: int, register: int) -> int | None:
        full_rpm = self.maximum_hz * 60
        return {
            0xB005: round(full_rpm),
            0xB006: 0x03F6,
            0x700C: round(abs(self.motor.rpm(now_s))),
            0x700D: 0,
        }.get(register)

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if register == 0x2000 and value in (1, 2, 6):
            self.run(now_s, {1: 1, 2: -1, 6: 0}[value])
            return True
        if register == 0x1000 and value <= 10000:
            self.set_speed(now_s, self.maximum_hz * value / 10000)
            return True
        return False


class H100(ModbusDrive):
    """Runs by coils; 0.1 Hz."""

    def read(self, now_s: float, function: int, register: int) -> int | None:
        if function == 0x04:
            return {0: round(abs(self.motor.hz(now_s)) * 10), 1: round(self.set_hz * 10)}.get(register)
        return {5: round(self.maximum_hz * 10), 11: 0}.get(register)

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if function == 0x05 and value == 0xFF00 and register in (0x49, 0x4A, 0x4B):
            self.run(now_s, {0x49: 1, 0x4A: -1, 0x4B: 0}[register])
            return True
        if function == 0x06 and register == 0x0201:
            self.set_speed(now_s, value / 10)
            return True
        return False


class Yl620(ModbusDrive):
    """Bits 1:0 of the command: 1 stops, 2 starts; bits 5:4: 1 forward, 2 reverse. 0.1 Hz."""

    units = 10

    def read(self, now_s: float, function: int, register: int) -> int | None:
        return {0x200A: round(self.set_hz * self.units), 0x200B: round(abs(self.motor.hz(now_s)) * self.units)}.get(
            register
        )

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if register == 0x2000:
            starts = value & 3 == 2
            self.run(now_s, {1: 1, 2: -1}.get(value >> 4 & 3, 0) if starts else 0)
            return value & 3 in (1, 2)
        if register == 0x2001:
            self.set_speed(now_s, value / self.units)
            return True
        return False


class DeltaMs300(Yl620):
    """The same command word; 0.01 Hz, current in 0.01 A."""

    units = 100

    def read(self, now_s: float, function: int, register: int) -> int | None:
        return {
            0x2102: round(self.set_hz * 100),
            0x2103: round(abs(self.motor.hz(now_s)) * 100),
            0x2104: round(self.ampere * 100),
        }.get(register)


class OwnRegisters(DeltaMs300):
    """A drive as grblHAL's defaults of $462 .. have it: Durapulse GS20."""


class NowForever(ModbusDrive):
    """Writes by function 10 only; bit 0 runs, bit 1 reverses; 0.01 Hz."""

    def read(self, now_s: float, function: int, register: int) -> int | None:
        return {
            0x0007: round(self.maximum_hz * 100),
            0x0008: 0,
            0x0500: (self.direction != 0) | (self.direction < 0) << 1,
            0x0502: round(abs(self.motor.hz(now_s)) * 100),
        }.get(register)

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if function != 0x10:
            return False
        if register == 0x0900:
            self.run(now_s, (-1 if value & 2 else 1) if value & 1 else 0)
            return True
        if register == 0x0901:
            self.set_speed(now_s, value / 100)
            return True
        return False


class Bd600(ModbusDrive):
    """2 is clockwise and 1 counter-clockwise, 6 stops; 0.01 % of the maximum; 0.1 Hz."""

    def read(self, now_s: float, function: int, register: int) -> int | None:
        return {0xF004: round(self.maximum_hz * 10), 0x3001: round(abs(self.motor.hz(now_s)) * 10)}.get(register)

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if register == 0x1000 and value in (1, 2, 6):
            self.run(now_s, {2: 1, 1: -1, 6: 0}[value])
            return True
        if register == 0x3000 and value <= 10000:
            self.set_speed(now_s, self.maximum_hz * value / 10000)
            return True
        return False


class SiemensV20(ModbusDrive):
    """Control word STW1: bit 0 runs, bit 10 control by the bus, bit 11 as FluidNC uses it; 16384 is P2000; signed."""

    def read(self, now_s: float, function: int, register: int) -> int | None:
        return {110: round(self.motor.hz(now_s) / self.maximum_hz * 16384)}.get(register)

    def write(self, now_s: float, function: int, register: int, value: int) -> bool:
        if register == 99:
            assert value & 0x047E == 0x047E, hex(value)  # enables, and control by the bus
            self.run(now_s, (1 if value & 0x0800 else -1) if value & 1 else 0)
            return True
        if register == 100 and value <= 16384:
            self.set_speed(now_s, self.maximum_hz * value / 16384)
            return True
        return False


# $395 -> the drive and what is set besides
MODELS: dict[int, tuple[type[Drive], dict[str, int], tuple[str, ...]]] = {
    1: (OwnRegisters, {}, ()),
    2: (HuanyangV1, {}, ()),
    3: (H2a, {"baud": 19200}, ()),
    4: (H100, {}, ()),
    5: (Yl620, {}, ()),
    6: (NowForever, {}, ()),
    7: (Bd600, {}, ("$461=30",)),
    8: (SiemensV20, {"parity": 1}, ()),
    9: (DeltaMs300, {}, ()),
}


def make_drive(number: int) -> tuple[Drive, tuple[str, ...]]:
    """The drive of $395, and its settings."""
    kind, line, settings = MODELS[number]
    drive = kind(**line)
    if number == 7:  # 4 poles: 24000 rpm at 800 Hz
        drive.motor.poles, drive.maximum_hz = 4, 800.0
    return drive, (f"$395={number}", *settings)
