"""No test fails because the computer is busy: its waits are caps against a hang, and its programs get Ctrl-C."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from patience import HANG_S
from rings import files_of_tests, name_of
from signals import ignored_signals, usual_signals

SHORT_S = 100.0
# A number of seconds after which a test would fail, or give up.
CAP = re.compile(
    r"(?:\bmonotonic\(\) \+ |\btimeout=|\bcap_s=|\bmost_s=|\.wait\(|\.join\(|\bsettimeout\(|\.reports\(|"
    r"\bcreate_connection\(\([^()]*(?:\([^()]*\))?[^()]*\), )([0-9][0-9_.]*)\b(?! \*)"
)
# seconds or cycles of the machine
VIRTUAL = {
    "support/stalled.py",
    "espsim/test_espsim_peripherals.py",
    "espsim/test_espsim_system.py",
    "espsim/test_espsim_waves.py",
}
# file -> waits there that no test fails by
PACES = {
    "esp32/test_shut_out.py": {  # strangers who come again and again
        'create_connection(("127.0.0.1", port), 1',
        'create_connection(("127.0.0.1", ports.telnet), 1',
    },
    "link/test_serve_link.py": {"watcher.wait(0.1)"},
    "motion/motion_host.py": {"self.wait(0.001)", "self.wait(0.02)"},
    "motion/test_motion_liveness.py": {"host.wait(0.002)"},
    "wire/test_lossy.py": {"monotonic() + 0.25"},
}


def short_caps(text: str) -> list[str]:
    return [found[0] for found in CAP.finditer(text) if float(found[1].rstrip(".")) < SHORT_S]


def test_no_wait_ends_early() -> None:
    for path in files_of_tests("*.py"):
        name = name_of(path)
        if name in VIRTUAL or path == Path(__file__):
            continue
        paces = PACES.get(name, set())
        found = [cap for cap in short_caps(path.read_text(encoding="utf-8")) if not any(cap in pace for pace in paces)]
        assert found == [], f"{name}: a busy computer is later than that; take HANG_S of tests/support/patience.py"


@pytest.mark.parametrize(
    "text",
    [
        "process.wait(10)",
        "run(a, timeout=20)",
        "end = time.monotonic() + 30",
        "next(device.reports(1.0))",
        "socket.create_connection((host, int(port)), 5)",
        "socket.create_connection((ADDRESS, PORT), 5, (HERE, 0))",
    ],
)
def test_a_short_one_is_found(text: str) -> None:
    assert len(short_caps(text)) == 1
    assert short_caps(text.replace(re.findall(r"\d+", text)[0], "HANG_S")) == []


@pytest.mark.parametrize("nohup", [False, True])
def test_a_program_under_test_gets_its_signals_whatever_we_inherit(nohup: bool) -> None:
    """As under `nohup`, and in the background of a shell without job control."""
    says = "import signal; print(signal.getsignal(signal.SIGINT) == signal.SIG_IGN)"
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with ignored_signals() if nohup else usual_signals():
            run = subprocess.run([sys.executable, "-c", says], capture_output=True, text=True, timeout=HANG_S)
    finally:
        signal.signal(signal.SIGINT, before)
    assert run.stdout.strip() == str(nohup) and os.name == "posix"
