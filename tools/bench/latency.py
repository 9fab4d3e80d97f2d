"""From a real-time byte or an e-stop to what the pins do: `make bench-latency`."""

from __future__ import annotations

import shutil
import socket
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from wificnc.board.load import load_board
from wificnc.build.mips import COMPILER
from wificnc.simulator.run import SimOptions, simulate
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server
from wificnc_chips.pic32mz import ESTIMATE, VirtualChip, board_image, motor_wire, pin_number, wired_chip

METHOD = """
PIC32MZ: the board's image in the virtual chip with the model of caches and buses (docs/pic32mz.md), 20 moments each,
spread over 10 ms; X at 250 steps/mm and 6000 mm/min, M3 S full, so that the output stays high. Quiet: one long move.
Busy: arcs of 3 mm whose lines fill the buffers, and status requests at 115200 baud without a pause. A byte counts from
the end of its stop bit, the e-stop from the edge of its pin. Deceleration begins with the first of ten steps whose mean
interval is 1 % longer than before. PC: the simulator in virtual time (`wificnc sim --at`), where a byte has no line to
travel. ESP32: the same in the periods and the lateness of its tasks (targets/chip/task_periods.h), from the byte in
the driver's ring; computing takes no time there. PC in real time: `wificnc serve` by TCP here, `?` without a
pause. `!`: until the first report of a feed 1 % lower has come. Ctrl-X: how long the machine went on, from the
position where it stands, its position in the report before, and its speed: negative by the way of that report."""

BOARD = "pic32mz2048efh100"
TRIALS = 20
SETTINGS = ("$110=6000", "$111=6000", "$112=6000", "$120=500", "$121=500", "$122=500", "$30=1000")
FULL_MM_MIN = 6000
LONG = f"G91G1X300F{FULL_MM_MIN}"
ARCS = "".join(f"G{2 + n % 2}X3Y{0.2 if n % 4 < 2 else -0.2}R30F6000\n" for n in range(40))
BYTE_S = 10 / 115200


@dataclass(frozen=True)
class Row:
    """A line of the table, seconds."""

    what: str
    values: list[float]

    def __str__(self) -> str:
        values_us = np.array(self.values) * 1e6
        return f"  {self.what:58} {np.median(values_us):10.1f} {values_us.max():10.1f} µs"


def slows_at(seconds: NDArray[np.float64], event_s: float) -> float:
    """When deceleration begins; `event_s` when it never does."""
    gaps = np.diff(seconds)
    before = np.median(gaps[seconds[1:] < event_s][-200:])
    means = np.convolve(gaps, np.ones(10) / 10, "valid")
    slow = np.flatnonzero((means > 1.01 * before) & (seconds[: len(means)] > event_s - 10 * before))
    return float(seconds[slow[0]]) if len(slow) else event_s


class Bench:
    """A chip in motion, its spindle on."""

    def __init__(self, busy: bool) -> None:
        self.board = load_board(BOARD)
        self.chip: VirtualChip = wired_chip(self.board, board_image(self.board))
        self.chip.timing(ESTIMATE)
        for axis in range(3):
            self.chip.set_axis(axis, motor_wire(self.board, axis))
        self.chip.run(0.05)
        self.chip.write("".join(f"{line}\n" for line in SETTINGS).encode())
        self.chip.run(1.0)
        self.chip.write(b"M3S1000\n" + (b"G91\n" + ARCS.encode() if busy else LONG.encode() + b"\n"))
        self.chip.run(0.3 if busy else 0.5)
        if busy:
            self.chip.write(b"?" * 400)
        self.chip.steps()
        self.chip.record_edges(True)

    def now_s(self) -> float:
        return self.chip.cycles / self.chip.cpu_hz

    def steps_s(self) -> NDArray[np.float64]:
        kinds = np.dtype([("cycle", "<u8"), ("more", "V8")])
        return np.frombuffer(self.chip.steps(), dtype=kinds)["cycle"].astype(np.float64) / self.chip.cpu_hz

    def pin(self, signal: str) -> int:
        return pin_number(self.board.pin_names()[signal])

    def dark_at(self) -> float:
        """When the spindle's output went low for good."""
        pin = self.pin("spindle_pwm")
        falls = [cycle for cycle, number, level in self.chip.edges() if number == pin and level == 0]
        return falls[-1] / self.chip.cpu_hz


def after_byte(bench: Bench, byte: bytes, phase_s: float, busy: bool) -> float:
    """Send it. @return when its stop bit ended"""
    bench.chip.run(0.02 + phase_s)
    if busy:
        while bench.chip.unread:
            bench.chip.run(BYTE_S / 20)
    bench.chip.write(byte)
    sent = bench.now_s() + BYTE_S
    bench.chip.run(0.03)
    return sent


def last_after(bench: Bench, event_s: float) -> float:
    """How long steps came; they did run before."""
    steps = bench.steps_s()
    assert np.count_nonzero((steps > event_s - 0.002) & (steps <= event_s)) > 5, "nothing moved"
    return max(0.0, float(steps[-1]) - event_s)


def chip_rows(busy: bool) -> list[Row]:
    where = "busy" if busy else "quiet"
    hold, estop, estop_dark, reset, reset_dark = [], [], [], [], []
    for trial in range(TRIALS):
        phase_s = 0.01 * trial / TRIALS
        if not busy:  # arcs change their speed by themselves
            bench = Bench(busy)
            sent = after_byte(bench, b"!", phase_s, busy)
            hold.append(slows_at(bench.steps_s(), sent) - sent)
        bench = Bench(busy)
        bench.chip.run(0.02 + phase_s)
        begin = bench.now_s()
        bench.chip.drive(bench.pin("estop"), 0)
        bench.chip.run(0.03)
        estop.append(last_after(bench, begin))
        estop_dark.append(bench.dark_at() - begin)
        bench = Bench(busy)
        sent = after_byte(bench, b"\x18", phase_s, busy)
        reset.append(last_after(bench, sent))
        reset_dark.append(bench.dark_at() - sent)
    rows = [Row("! to the beginning of the deceleration, quiet", hold)] if hold else []
    return [
        *rows,
        Row(f"e-stop to the last pulse, {where}", estop),
        Row(f"e-stop to beam or spindle off, {where}", estop_dark),
        Row(f"Ctrl-X to the last pulse, {where}", reset),
        Row(f"Ctrl-X to beam or spindle off, {where}", reset_dark),
    ]


def simulated_steps_s(folder: Path, at: str, board: str) -> NDArray[np.float64]:
    job, trace = folder / "job.nc", folder / "trace.csv"
    job.write_text(LONG + "\n")
    simulate(SimOptions(file=job, board=board, settings=SETTINGS, trace=trace, keep_going=True, at=(at,)))
    return np.loadtxt(trace, delimiter=",", skiprows=1, usecols=0, ndmin=1) * 1e-9


def simulated_rows(board: str) -> list[Row]:
    hold: list[float] = []
    last: dict[str, list[float]] = {"estop": [], "soft-reset": []}
    with tempfile.TemporaryDirectory() as name:
        for trial in range(TRIALS):
            event_s = 1.0 + 0.01 * trial / TRIALS
            steps = simulated_steps_s(Path(name), f"{event_s:.6f}s feed-hold", board)
            hold.append(slows_at(steps, event_s) - event_s)
            for event, values in last.items():
                steps = simulated_steps_s(Path(name), f"{event_s:.6f}s {event}", board)
                values.append(max(0.0, float(steps[-1]) - event_s))
    return [
        Row("! to the beginning of the deceleration", hold),
        Row("e-stop to the last pulse", last["estop"]),
        Row("Ctrl-X to the last pulse", last["soft-reset"]),
    ]


Report = tuple[float, float, float]  # when it had come, X in mm, feed in mm/min


class Sender:
    """A client of a serving controller that asks for its status without a pause."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host.strip("[]"), int(port)), 10.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._rest = b""

    def __enter__(self) -> Sender:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, data: bytes) -> float:
        self._socket.sendall(data)
        return time.perf_counter()

    def line(self) -> str:
        while b"\n" not in self._rest:
            self._rest += self._socket.recv(4096)
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode().strip()

    def until(self, word: str) -> None:
        while not self.line().startswith(word):
            pass

    def report(self) -> Report:
        self.send(b"?")
        while not (line := self.line()).startswith("<"):
            pass
        x = float(line.split("MPos:")[1].split(",")[0])
        return time.perf_counter(), x, float(line.split("FS:")[1].split(",")[0])

    def move(self, phase_s: float) -> Report:
        """At full speed, `phase_s` later. @return the newest report"""
        for line in (b"$X\n", b"G90G0X0\n", b"G4P0.01\n"):
            self.send(line)
            self.until("ok")
        self.send(LONG.encode() + b"\n")
        self.until("ok")
        while (newest := self.report())[2] < FULL_MM_MIN - 1:
            pass
        end = newest[0] + 0.05 + phase_s
        while newest[0] < end:
            newest = self.report()
        return newest


def real_time_rows() -> list[Row]:
    hold: list[float] = []
    reset: list[float] = []
    options = ServeOptions(board=load_board("host"), tcp=Address("127.0.0.1", 0), settings=SETTINGS)
    with Server(options) as server, Sender(str(server.tcp)) as sender:
        for trial in range(TRIALS):
            sender.move(0.01 * trial / TRIALS)
            sent = sender.send(b"!")
            while (newest := sender.report())[2] > 0.99 * FULL_MM_MIN:
                pass
            hold.append(newest[0] - sent)
            sender.send(b"\x18")
            sender.until("Grbl")
            came, x_mm, _ = sender.move(0.01 * trial / TRIALS)
            sent = sender.send(b"\x18")
            sender.until("Grbl")
            reset.append((sender.report()[1] - x_mm) / (FULL_MM_MIN / 60) - (sent - came))
            sender.send(b"\x18")
            sender.until("Grbl")
    return [Row("! to a report of a lower feed", hold), Row("Ctrl-X to the last pulse, by positions", reset)]


def show(title: str, rows: list[Row]) -> None:
    print(f"\n{title:60} {'median':>10} {'longest':>10}")
    for row in rows:
        print(row)


def main() -> int:
    print(METHOD)
    if shutil.which(COMPILER):
        show("PIC32MZ, serial port", [*chip_rows(busy=False), *chip_rows(busy=True)])
    else:
        print(f"  the PIC32MZ is not measured: there is no {COMPILER} here")
    show("PC, virtual time", simulated_rows("host"))
    show("ESP32, times of its tasks", simulated_rows("esp32-wroom32"))
    show("PC, real time, TCP", real_time_rows())
    return 0


if __name__ == "__main__":
    sys.exit(main())
