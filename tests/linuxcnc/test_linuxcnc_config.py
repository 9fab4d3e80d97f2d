"""`wificnc linuxcnc init`, and LinuxCNC itself with what it writes."""

from __future__ import annotations

import configparser
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.errors import UserError
from wificnc.linuxcnc.config import files
from wificnc.machine import load_machine
from wificnc.machine.load import find_machines
from wificnc.machine.model import Axes
from wificnc.serve.options import ServeOptions
from wificnc.serve.server import Server
from wificnc.wmc3.device import Device

ADDRESS = f"127.60.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
# what a user would do at the screen, and where it leads
PROGRAM = """#!/usr/bin/python3
import linuxcnc, time
command, status = linuxcnc.command(), linuxcnc.stat()
def wait(what):
    for _ in range(200):
        status.poll()
        if what():
            return
        time.sleep(0.05)
    raise SystemExit("timeout")
command.state(linuxcnc.STATE_ESTOP_RESET)
wait(lambda: status.task_state == linuxcnc.STATE_ESTOP_RESET)
command.state(linuxcnc.STATE_ON)
wait(lambda: status.task_state == linuxcnc.STATE_ON)
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
wait(lambda: all(status.homed[:3]))
command.mode(linuxcnc.MODE_MDI)
command.wait_complete()
for line in ("G21 G90 G0 X-10 Y-20", "G1 X-30.5 Z-4 F600", "G2 X-20.5 I5 F500", "G0 X-1.23 Y-4.56 Z-7.89"):
    command.mdi(line)
    assert command.wait_complete(30) == linuxcnc.RCS_DONE, line
time.sleep(1)
"""


def invoke(*arguments: str) -> str:
    result = CliRunner().invoke(root, ["linuxcnc", *arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


@pytest.mark.parametrize("machine", find_machines())
def test_limits_are_those_of_the_profile(machine: str, tmp_path: Path) -> None:
    axes = load_machine(machine).axis
    invoke("init", machine, "--to", "192.168.1.50", "--out", str(tmp_path))
    ini = configparser.ConfigParser(strict=False)
    ini.read(tmp_path / f"{machine}.ini")
    for joint, (_, axis) in enumerate(axes.present()):
        section = ini[f"JOINT_{joint}"]
        values = dict(axis.assigned())
        assert float(section["MAX_VELOCITY"]) == pytest.approx(float(values["max_rate_mm_min"]) / 60, rel=1e-5)
        assert float(section["SCALE"]) == pytest.approx(float(values["steps_per_mm"]), rel=1e-5)
    assert ini["WIFICNC"]["ADDRESS"] == "192.168.1.50"


def test_nothing_is_written_over(tmp_path: Path) -> None:
    arguments = ("init", "baseline", "--to", "127.0.0.1", "--out", str(tmp_path))
    invoke(*arguments)
    with pytest.raises(UserError, match="is there already"):
        invoke(*arguments)
    invoke(*arguments, "--force")


def test_axes_with_a_gap_are_refused() -> None:
    axis = {"steps_per_mm": 80.0, "max_rate_mm_min": 3000.0, "acceleration_mm_s2": 200.0}
    with pytest.raises(ValueError, match="without a gap"):
        files("gap", ADDRESS, Axes.model_validate({"x": axis, "z": axis}))


def test_linuxcnc_moves_a_machine_to_the_step(user_home: Path, as_user: Callable[..., str]) -> None:
    """All of LinuxCNC 2.9 with the written configuration; only its screen is ours."""
    profile = load_machine("router_3018")
    invoke("init", "router_3018", "--to", ADDRESS, "--out", str(user_home / "config"))
    ini = user_home / "config" / "router_3018.ini"
    text = ini.read_text().replace("DISPLAY = axis", "DISPLAY = ./screen.py")
    # LinuxCNC without real time, on a computer that is busy with tests, may be late by seconds
    ini.write_text("\n".join("MIN_FERROR = 900" if "FERROR" in line else line for line in text.splitlines()))
    screen = user_home / "config" / "screen.py"
    screen.write_text(PROGRAM)
    for path in (user_home / "config", *(user_home / "config").iterdir()):
        path.chmod(0o777)
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=profile.settings_lines())):
        as_user("linuxcnc", "-r", str(ini))
        with Device(ADDRESS) as device:
            status = list(device.reports(0.3))[-1]
    assert status.position_steps[:3] == tuple(round(mm * 800) for mm in (-1.23, -4.56, -7.89))
