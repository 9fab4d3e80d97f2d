"""A restart that was not requested (watchdog, fault, brown-out ...) locks the machine until `$X` or homing, and each
client gets its cause: those at the banner, those that connect later, and `$I`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from grbl_host import BANNER, HZ, LOCKED, Grbl
from layouts import HOST
from wificnc.simulator.library import HostBoard, Tasks

CAUSE = HOST.enum("hal_restart_cause")
NONE, WATCHDOG, FAULT, BROWN_OUT, OSCILLATOR, EXTERNAL, UNKNOWN = (
    CAUSE[f"HAL_RESTART_{name}"]
    for name in ("NONE", "WATCHDOG", "FAULT", "BROWN_OUT", "OSCILLATOR", "EXTERNAL", "UNKNOWN")
)
WORDS = {
    WATCHDOG: "watchdog",
    FAULT: "fault",
    BROWN_OUT: "brown-out",
    OSCILLATOR: "lost oscillator",
    EXTERNAL: "reset in motion",
    UNKNOWN: "unknown cause",
}
ADDRESS = 0x9D00A5F0
ALARM = "ALARM:56\r\n"


@contextmanager
def restarted(cause: int, store: Path | None = None, tasks: Tasks = Tasks.FREE, address: int = 0) -> Iterator[Grbl]:
    board = HostBoard(HZ, 1000, 500, 500_000, 3, tasks=tasks, restart=cause, restart_address=address)
    grbl = Grbl(board=board, store=store)
    try:
        yield grbl
    finally:
        grbl.close()


def told(cause: int) -> str:
    return f"[MSG:Restarted by {WORDS[cause]}]\r\n"


@pytest.mark.parametrize("tasks", list(Tasks))
@pytest.mark.parametrize("homing", [False, True])
@pytest.mark.parametrize("cause", list(WORDS))
def test_each_cause_locks_and_is_reported(cause: int, homing: bool, tasks: Tasks, tmp_path: Path) -> None:
    store = tmp_path / "store"
    with restarted(NONE, store) as before:
        before.heard()
        before.fine(f"$22={int(homing)}")
        before.fine("$N0=G0X50")
    with restarted(cause, store, tasks) as grbl:
        assert grbl.heard() == BANNER + ALARM + told(cause) + LOCKED
        assert grbl.state() == "Alarm"
        assert grbl.send("G1X5F1000\n") == "error:9\r\n"
        assert grbl.send("$J=G91X5F1000\n") == "error:8\r\n"
        assert grbl.position() == [0] * 6, "no startup line moves it either"


def test_power_on_is_none(grbl: Grbl) -> None:
    assert grbl.state() == "Idle"
    assert "RESTART" not in grbl.send("$I\n")


def test_a_reset_keeps_the_lock_and_its_cause() -> None:
    with restarted(WATCHDOG) as grbl:
        grbl.heard()
        assert grbl.send("\x18") == BANNER + ALARM + told(WATCHDOG) + LOCKED
        assert grbl.state() == "Alarm"


def test_sleep_keeps_the_lock_and_its_cause() -> None:
    with restarted(WATCHDOG) as grbl:
        grbl.send("$SLP\n")
        assert grbl.send("\x18") == BANNER + ALARM + told(WATCHDOG) + LOCKED


def test_an_estop_meanwhile_keeps_the_lock_and_its_cause() -> None:
    with restarted(WATCHDOG) as grbl:
        grbl.input("estop", True)
        grbl.send("")
        grbl.input("estop", False)
        grbl.after(1.0, "")
        assert grbl.send("\x18") == BANNER + ALARM + told(WATCHDOG) + LOCKED


def test_later_clients_get_it_until_it_is_unlocked() -> None:
    with restarted(FAULT, address=ADDRESS) as grbl:
        assert grbl.notices() == [
            f"Restarted by fault at 0x{ADDRESS:08X}",
            "Locked by ALARM:56: '$H'|'$X' to unlock",
        ]
        grbl.send("$X\n")
        assert grbl.state() == "Idle"
        assert grbl.notices() == []
        assert grbl.send("\x18") == BANNER
        assert grbl.send("G1X5F1000\n") == "ok\r\n"


def test_build_info_has_the_cause_also_after_the_unlock() -> None:
    with restarted(FAULT, address=ADDRESS) as grbl:
        line = f"[RESTART:fault at 0x{ADDRESS:08X}]\r\n"
        assert line in grbl.send("$I\n")
        grbl.send("$X\n")
        assert line in grbl.send("$I\n")


@pytest.mark.parametrize(("command", "free"), [("$H", True), ("$HX", False)])
def test_homing_all_axes_unlocks(command: str, free: bool, tmp_path: Path) -> None:
    store = tmp_path / "store"
    with restarted(NONE, store) as before:
        before.heard()
        for line in ("$22=1", "$44=4", "$45=3", "$46=0"):
            before.fine(line)
    with restarted(WATCHDOG, store) as grbl:
        for axis in range(3):
            grbl.travel(axis, -25_000, 25_000)
        grbl.send(command + "\n")
        assert grbl.state() == ("Idle" if free else "Alarm")
        assert bool(grbl.notices()) != free


def test_damaged_storage_is_acknowledged_first(tmp_path: Path) -> None:
    store = tmp_path / "store"
    with restarted(NONE, store) as before:
        before.heard()
        before.fine("$110=4000")
    raw = bytearray(store.read_bytes())
    raw[len(raw) // 2] ^= 0xFF
    store.write_bytes(raw)
    with restarted(BROWN_OUT, store) as grbl:
        assert told(BROWN_OUT) in grbl.heard()
        assert grbl.notices()[-1] == "Restarted by brown-out"
        assert grbl.send("$X\n") != "ok\r\n"
        grbl.send("$ACK\n")
        assert grbl.notices()[-1] == "Locked by ALARM:56: '$H'|'$X' to unlock"
        assert grbl.state() == "Alarm"
        grbl.send("$X\n")
        assert grbl.state() == "Idle"
