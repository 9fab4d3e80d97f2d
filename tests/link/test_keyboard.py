"""`wificnc send` at a real terminal: keys, Ctrl-C, and the terminal given back as it was."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path
from types import TracebackType

import pytest
from core_bridge import Bridge
from patience import HANG_S
from signals import ignored_signals, usual_signals

ROOT = Path(__file__).resolve().parents[2]
CTRL_C = b"\x03"


class Terminal:
    """The program under test, at a terminal of its own. A context manager."""

    def __init__(self, *arguments: str, nohup: bool = False) -> None:
        self.master, slave = pty.openpty()
        self.before = termios.tcgetattr(slave)
        self.slave = slave
        self.shown = ""
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "cli"), "TERM": "xterm", "COLUMNS": "160"}
        with ignored_signals() if nohup else usual_signals():
            self.process = subprocess.Popen(
                [sys.executable, "-m", "wificnc", *arguments],
                stdin=slave, stdout=slave, stderr=slave, env=environment, preexec_fn=_own_terminal,
            )  # fmt: skip

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, tb: TracebackType | None) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.master)
        os.close(self.slave)

    def expect(self, text: str) -> None:
        """Read until the program has shown this."""
        deadline = time.monotonic() + HANG_S
        while text not in self.shown:
            left_s = deadline - time.monotonic()
            assert left_s > 0, f"{text!r} was never shown: {self.shown[-2000:]!r}"
            if select.select([self.master], [], [], left_s)[0]:
                self.shown += os.read(self.master, 65536).decode("utf-8", "replace")

    def press(self, keys: bytes) -> None:
        self.shown = ""
        os.write(self.master, keys)

    def ended(self) -> int:
        """Its exit code."""
        deadline = time.monotonic() + HANG_S
        while (code := self.process.poll()) is None:
            assert time.monotonic() < deadline, self.shown[-2000:]
            if select.select([self.master], [], [], 0.05)[0]:
                self.shown += os.read(self.master, 65536).decode("utf-8", "replace")
        while select.select([self.master], [], [], 0)[0]:
            self.shown += os.read(self.master, 65536).decode("utf-8", "replace")
        return code

    def modes(self) -> list[object]:
        return termios.tcgetattr(self.slave)


def _own_terminal() -> None:
    """A session whose controlling terminal is stdin, so that Ctrl-C becomes SIGINT there."""
    import fcntl

    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.fixture
def job(tmp_path: Path) -> str:
    path = tmp_path / "job.nc"
    moves = [f"G1 X{i % 7} Y{i % 5}" for i in range(300)]
    path.write_text("\n".join(["G21 G90", "F600", *moves, "G0 X1 Y2"]) + "\n")
    return str(path)


def test_ctrl_c_asks_and_resume_goes_on(bridge: Bridge, job: str) -> None:
    bridge.slow_after(40)
    with Terminal("send", job, "--to", bridge.target) as terminal:
        bridge.wait_answers(60)
        terminal.press(CTRL_C)
        terminal.expect("r: resume")
        terminal.press(b"r")
        assert terminal.ended() == 0
        assert "finished: 303 of 303 lines, 0 errors" in terminal.shown
        assert terminal.modes() == terminal.before
    assert bridge.position_steps()[:2] == [250, 500]


def test_ctrl_c_asks_and_x_stops(bridge: Bridge, job: str) -> None:
    bridge.slow_after(40)
    with Terminal("send", job, "--to", bridge.target) as terminal:
        bridge.wait_answers(60)
        terminal.press(CTRL_C)
        terminal.expect("x: stop and reset")
        terminal.press(b"x")
        assert terminal.ended() == 1
        assert "Last line acknowledged: line" in terminal.shown
        assert "NOT finished" in terminal.shown
        assert terminal.modes() == terminal.before


def test_second_ctrl_c_resets(bridge: Bridge, job: str) -> None:
    bridge.slow_after(40)
    with Terminal("send", job, "--to", bridge.target) as terminal:
        bridge.wait_answers(60)
        terminal.press(CTRL_C)
        terminal.expect("Ctrl-C: reset immediately")
        terminal.press(CTRL_C)
        assert terminal.ended() == 1
        assert "reset by the operator" in terminal.shown


def test_x_asks_before_it_resets(bridge: Bridge, job: str) -> None:
    bridge.slow_after(40)
    with Terminal("send", job, "--to", bridge.target) as terminal:
        bridge.wait_answers(60)
        terminal.press(b"x")
        terminal.expect("Reset now?")
        terminal.press(b"n")
        terminal.expect("q quit")
        terminal.press(b"x")
        terminal.expect("Reset now?")
        terminal.press(b"y")
        assert terminal.ended() == 1
        assert terminal.modes() == terminal.before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_being_ended_stops_the_machine_first(bridge: Bridge, job: str, number: signal.Signals) -> None:
    bridge.slow_after(40)
    with Terminal("send", job, "--to", bridge.target) as terminal:
        bridge.wait_answers(60)
        terminal.expect("q quit")
        terminal.process.send_signal(number)
        assert terminal.ended() == 1
        assert "the sender was terminated" in terminal.shown
        assert terminal.modes() == terminal.before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_signals_that_were_ignored_at_the_start_stay_so(bridge: Bridge, job: str, number: signal.Signals) -> None:
    """A job that was started by nohup outlives its terminal."""
    with Terminal("send", job, "--to", bridge.target, nohup=True) as terminal:
        bridge.at_answer(60, lambda: terminal.process.send_signal(number))
        assert terminal.ended() == 0
        assert "finished: 303 of 303 lines, 0 errors" in terminal.shown
    assert bridge.position_steps()[:2] == [250, 500]


def test_resume_asks_at_the_terminal(bridge: Bridge, job: str) -> None:
    with Terminal("send", job, "--to", bridge.target, "--from-line", "200") as terminal:
        terminal.expect("Start the resume?")
        assert "G0X0Y1" in terminal.shown
        terminal.press(b"n\n")
        assert terminal.ended() == 1
        assert "nothing was sent" in terminal.shown
    assert bridge.position_steps()[:2] == [0, 0]


def test_monitor_types_and_shows(bridge: Bridge) -> None:
    with Terminal("monitor", "--to", bridge.target) as terminal:
        terminal.expect("Ctrl-C ends")
        terminal.press(b"G0X\x7fX2\r")
        terminal.expect("> G0X2")
        terminal.expect("ok")
        terminal.press(b"?")
        terminal.expect("|MPos:")
        terminal.press(CTRL_C)
        assert terminal.ended() == 0
        assert terminal.modes() == terminal.before
    assert bridge.position_steps()[0] == 500
