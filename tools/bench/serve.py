"""Measure a serving controller as senders see it: python -m bench.serve [streams | reports | pace] [--lines N]."""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

from bench.streams import Door, StreamError, pour, program, rest_mm

SETTINGS = tuple(
    f"${base + axis}={value}" for base, value in ((100, 250), (110, 10000), (120, 2000)) for axis in range(3)
)
LINES = 1_000_000
ASKS = 2000
REPORT_MS = 5.0
BLOCKS_PER_S, PACE_BLOCKS, BLOCK_MM = 1000, 30_000, 0.05
WATCHERS = 8
CHUNK = 4096  # bytes of the job between two questions

STREAMS = """
Streams: `wificnc serve --speed max`, one sender that pours {lines:,} short relative moves (every 997th line is wrong)
as fast as they go in and holds each answer against the one it has to be; then the position, the sum of all moves."""
REPORTS = """
Reports: `wificnc serve`, {asks:,} times from sending ? to the whole report, by TCP on this computer, one after the
other, while the load goes on; {chunk:,} bytes of the job go before each question where there is room for them."""
PACE = """
Pace: `wificnc serve --speed 1`, {blocks:,} blocks of {mm} mm at {feed:.0f} mm/min, so {rate} blocks/s in real time,
poured by TCP; how often motion came to rest for want of the next block, and how long it all took."""


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", help="streams, reports, pace; default: all")
    parser.add_argument("--lines", type=int, default=LINES, help=f"of a stream, default {LINES:,}")
    asked = parser.parse_args()
    parts = {"streams": lambda: streams(asked.lines), "reports": reports, "pace": pace}
    unknown = set(asked.parts) - set(parts)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: there are {', '.join(parts)}")
    print(f"Python {platform.python_version()}, {platform.machine()}")
    try:
        good = [parts[name]() for name in asked.parts or parts]
    except StreamError as err:
        print(f"  WRONG: {err}")
        return 1
    return 0 if all(good) else 1


@contextmanager
def serving(speed: float) -> Iterator[Server]:
    """A controller of the host board at any free port, with a pty and hands."""
    with tempfile.TemporaryDirectory() as folder:
        options = ServeOptions(
            board=load_board("host"),
            tcp=Address("127.0.0.1", 0),
            pty=Path(folder) / "tty",
            control=0,
            speed=speed,
            settings=SETTINGS,
        )
        with Server(options) as server:
            yield server


def tcp(server: Server) -> str:
    assert server.tcp
    return server.tcp


def counters(server: Server) -> dict[str, int]:
    """What the controller has counted."""
    assert server.control
    with Door(server.control) as hands:
        words = hands.ask(b"counters\n", "lines").split()
    return {name: int(number) for name, number in zip(words[::2], words[1::2], strict=True)}


def streams(lines: int) -> bool:
    """Through each door. Raises StreamError."""
    print(STREAMS.format(lines=lines))
    job = program(lines)
    for kind in ("tcp", "pty"):
        with serving(0.0) as server:
            assert server.options.pty
            before = counters(server)["lines"]
            with Door(tcp(server) if kind == "tcp" else server.options.pty) as door:
                seconds = pour(door, job.lines, job.answers)
                position = rest_mm(door)
            answered = counters(server)["lines"] - before
        if position != job.end_mm() or answered != lines:
            raise StreamError(f"{kind}: {answered} lines, ends at {position} instead of {job.end_mm()}")
        print(f"  {kind}: {lines:,} answers in order, position {position} exact, {lines / seconds:,.0f} lines/s")
    return True


def short_segments(blocks: int) -> list[str]:
    """One long line: no corner slows it down."""
    feed = BLOCK_MM * BLOCKS_PER_S * 60
    return [f"G21G91G94G1F{feed:.0f}", *(f"X{BLOCK_MM}" for _ in range(blocks))]


@dataclass(frozen=True)
class Load:
    """What continues while someone asks. speed: 1 real time, 0 as fast as it goes."""

    title: str
    speed: float = 1.0
    job: tuple[str, ...] = ()
    watchers: int = 0
    floods: bool = False


SHORT = tuple(short_segments(PACE_BLOCKS))
LONG = ("G21G90G94G1F60000", *("X1000", "X0") * (PACE_BLOCKS // 2))
LOADS = (
    Load("at rest"),
    Load("1 000 blocks/s", job=SHORT),
    Load(f"1 000 blocks/s, {WATCHERS} observers", job=SHORT, watchers=WATCHERS),
    Load("the same, and they flood with ? and lines", job=SHORT, watchers=WATCHERS, floods=True),
    Load("--speed max, short moves, 4 observers", speed=0.0, job=SHORT, watchers=4),
    Load("--speed max, long moves, 4 observers", speed=0.0, job=LONG, watchers=4),
)


def reports() -> bool:
    """The time to a report under each load."""
    print(REPORTS.format(asks=ASKS, chunk=CHUNK))
    good = [_report_times(load) for load in LOADS]  # every one is measured
    return all(good)


def _report_times(load: Load) -> bool:
    job = "".join(f"{line}\n" for line in load.job).encode()
    with serving(load.speed) as server, ExitStack() as stack:
        owner = stack.enter_context(Door(tcp(server)))
        owner.ask(b"G21\n", "ok")  # it commands, and is answered immediately
        data = memoryview(job)
        data = data[owner.write(data) :]
        others = [stack.enter_context(Door(tcp(server))) for _ in range(load.watchers)]
        times = []
        for _ in range(ASKS):
            begin = time.perf_counter()
            owner.ask(b"?", "<")
            times.append(1000 * (time.perf_counter() - begin))
            data = data[owner.write(data[:CHUNK]) :] or memoryview(job)
            for other in others:
                other.lines()
                if load.floods:
                    other.write(b"?" * 100 + b"G0X1\n" * 20)
    times.sort()
    p99 = times[len(times) * 99 // 100]
    mark = "" if p99 <= REPORT_MS else "  OVER"
    print(
        f"  {load.title:45} median {times[len(times) // 2]:.2f} ms, 99 % {p99:.2f} ms, longest {times[-1]:.2f} ms{mark}"
    )
    return p99 <= REPORT_MS


def pace() -> bool:
    """Real time, for as long as the job lasts. Raises StreamError."""
    print(PACE.format(blocks=PACE_BLOCKS, mm=BLOCK_MM, feed=BLOCK_MM * BLOCKS_PER_S * 60, rate=BLOCKS_PER_S))
    lines = short_segments(PACE_BLOCKS)
    with serving(1.0) as server:
        with Door(tcp(server)) as door:
            begin = time.monotonic()
            pour(door, lines, ["ok"] * len(lines))
            position = rest_mm(door)
            seconds = time.monotonic() - begin
        counted = counters(server)
    if position[0] != round(PACE_BLOCKS * BLOCK_MM, 3):
        raise StreamError(f"it ends at {position}")
    ideal = PACE_BLOCKS / BLOCKS_PER_S
    print(f"  {counted['blocks']:,} blocks, {seconds:.2f} s instead of {ideal:.2f} s", end="")
    print(f", look-ahead starved {counted['starved']} times, {counted['underruns']} underruns")
    return counted["starved"] == 0 and counted["underruns"] == 0


if __name__ == "__main__":
    sys.exit(main())
