"""All of LinuxCNC with the written configuration, whose FERROR and MIN_FERROR it keeps, on a network that loses
datagrams. docs/linuxcnc.md has its figures."""

from __future__ import annotations

import ast
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from lossy import Lossy
from test_linuxcnc_config import MACHINE, SWITCH, fake_tool_change, hands, invoke
from test_linuxcnc_session import STOPPED
from wificnc.board.load import load_board
from wificnc.profile import load_machine
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

HERE = f"127.69.{os.getpid() >> 8 & 0xFF}"  # the ports are fixed
DEVICE, NETWORK, LOCAL = f"{HERE}.1", f"{HERE}.2", f"{HERE}.3"
END_MM = (-5.125, -5.5)
LOCKED = "The controller is locked until all axes are homed."  # at power-on
# From side to side at 3000 mm/min, with short moves between: 28 s
PROGRAM = (
    "G21 G90 G94 G64 P0.02\nG0 X-5 Y-5\n"
    + "".join(f"G1 X{-10 - 40 * (n % 2)} Y{-10 - n} F3000\nG1 X{-12 - 36 * (n % 2)} Y{-10.5 - n}\n" for n in range(32))
    + "G1 X{} Y{}\nM2\n".format(*END_MM)
)
SCREEN = (
    """#!/usr/bin/python3
import linuxcnc, pathlib, time
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
shown, seen = [], {"behind_mm": 0.0}
def wait(what, most_s=200):
    end = time.monotonic() + most_s
    while status.poll() or not what():
        while (error := errors.poll()):
            shown.append(error[1].strip())
        seen["behind_mm"] = max([seen["behind_mm"], *(abs(joint["ferror_current"]) for joint in status.joint[:3])])
        if time.monotonic() > end or status.task_state == linuxcnc.STATE_ESTOP and seen.get("homed"):
            raise SystemExit
        time.sleep(0.01)
"""
    + SWITCH
    + """try:
    switch(linuxcnc.STATE_ESTOP_RESET)
    switch(linuxcnc.STATE_ON)
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    wait(lambda: all(status.homed[:3]))
    seen["homed"] = True
    seen["behind_mm"] = 0.0
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(str(pathlib.Path("program.ngc").absolute()))
    command.wait_complete()
    begun = time.monotonic()
    command.auto(linuxcnc.AUTO_RUN, 0)
    wait(lambda: status.interp_state != linuxcnc.INTERP_IDLE)
    wait(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos or status.task_state != linuxcnc.STATE_ON)
    seen["took_s"] = time.monotonic() - begun
    seen["on"] = status.task_state == linuxcnc.STATE_ON
    wait(lambda: all(abs(joint["ferror_current"]) < 0.003 for joint in status.joint[:2]), 10)
    seen["at_mm"] = tuple(joint["input"] for joint in status.joint[:2])
finally:
    pathlib.Path("said").write_text(repr((seen, shown)))
"""
)


def run(home: Path, as_user: Callable[..., str], loss: float) -> tuple[dict[str, Any], list[str]]:
    """@return what LinuxCNC's side has seen and shown"""
    home.mkdir(mode=0o777)
    home.chmod(0o777)
    (home / "small.toml").write_text(MACHINE)
    config = home / "config"
    invoke("init", str(home / "small.toml"), "--to", NETWORK, "--out", str(config))
    ini = config / "small.ini"
    ini.write_text(ini.read_text().replace("DISPLAY = axis", "DISPLAY = ./screen.py"))
    (config / "screen.py").write_text(SCREEN)
    (config / "program.ngc").write_text(PROGRAM)
    fake_tool_change(config)
    for path in (config, *config.iterdir()):
        path.chmod(0o777)
    profile = load_machine(str(home / "small.toml"))
    options = ServeOptions(
        board=load_board("host"), wmc3=DEVICE, control=0, settings=profile.settings_lines(), store=home / "store"
    )
    network = Lossy(DEVICE, NETWORK, loss=loss, duplicate=loss / 2, delay_ms=(0.0, 20.0), local=LOCAL)
    with Server(options) as server, network, ThreadPoolExecutor(1) as pool:
        hands(server, "travel x -3 90", "travel y -90 3", "travel z -90 3")
        pool.submit(as_user, "linuxcnc", "-r", str(ini)).result()
        lost = (network.to_device.lost, network.to_host.lost)
    seen, shown = ast.literal_eval((config / "said").read_text())
    assert loss == 0 or min(lost) > 20, "the network was bad"
    return seen, shown


@pytest.mark.deep  # link_bench.py has the component on such a network, in virtual time (test_linuxcnc_hold.py)
@pytest.mark.parametrize("loss", [0.0, 0.03, 0.1, 0.2, 0.3])
def test_a_program_ends_where_it_should(user_home: Path, as_user: Callable[..., str], loss: float) -> None:
    for attempt in range(3):
        seen, shown = run(user_home / f"try{attempt}", as_user, loss)
        print(f"{loss:.0%} lost: {seen} {shown}")
        if not any(STOPPED in text for text in shown):
            break
    assert seen["on"] and shown == [LOCKED]
    assert seen["at_mm"] == pytest.approx(END_MM, abs=0.003), "by the controller's steps"
