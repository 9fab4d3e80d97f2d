"""All of LinuxCNC with the written configuration, and a controller that is held, reset, switched off and on."""

from __future__ import annotations

import ast
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from test_linuxcnc_config import MACHINE, SWITCH, fake_tool_change, hands, invoke
from wificnc.board.load import load_board
from wificnc.profile import load_machine
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

ADDRESS = f"127.68.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
# LinuxCNC's side: it asks us to do something at the controller by a file, and continues when that is gone
SCREEN = (
    """#!/usr/bin/python3
import linuxcnc, os, pathlib, signal, subprocess, time
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
seen, shown = {}, []
def pin(name):
    return subprocess.run(["halcmd", "getp", name], capture_output=True, text=True).stdout.strip()
def wait(what, most_s=300):
    end = time.monotonic() + most_s
    while status.poll() or not what():
        while (error := errors.poll()):
            shown.append(error[1].strip())
        assert time.monotonic() < end, ("timeout", seen, shown)
        time.sleep(0.02)
def do(what):
    pathlib.Path("new").write_text(what)
    pathlib.Path("new").rename("do")
    wait(lambda: not pathlib.Path("do").exists())
def is_at(x):
    return abs(status.actual_position[0] - x) < 0.002
"""
    + SWITCH
    + """def switch_on():
    switch(linuxcnc.STATE_ESTOP_RESET)
    switch(linuxcnc.STATE_ON)
def home():
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    wait(lambda: all(status.homed[:3]))
def mdi(line):
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    command.mdi(line)
switch_on()
home()
mdi("G1 X-30 F300")
wait(lambda: status.actual_position[0] > -57)
do("!")
wait(lambda: pin("motion.feed-inhibit") == "TRUE")
time.sleep(1)
status.poll()
before = status.position[0]
time.sleep(7)
status.poll()
seen["waits"] = status.position[0] == before and status.task_state == linuxcnc.STATE_ON and not is_at(-30)
do("~")
wait(lambda: is_at(-30))
mdi("G1 X-50 F300")
wait(lambda: status.actual_position[0] < -31)
do("!")
wait(lambda: pin("wificnc.held") == "TRUE")
time.sleep(0.5)
command.state(linuxcnc.STATE_OFF)
wait(lambda: status.task_state != linuxcnc.STATE_ON)
time.sleep(0.5)
status.poll()
before = status.actual_position[0]
do("~")
time.sleep(1)
status.poll()
seen["off"] = status.actual_position[0] == before
switch_on()
do("off")
wait(lambda: status.task_state == linuxcnc.STATE_ESTOP)
do("on")
wait(lambda: not any(status.homed[:3]))
seen["unhomed"] = (pin("wificnc.connected"), pin("wificnc.locked"))
wait(lambda: pin("wificnc.estop-ok") == "TRUE")
time.sleep(0.5)
status.poll()
seen["latched"] = status.task_state == linuxcnc.STATE_ESTOP
switch_on()
seen["locked"] = pin("wificnc.locked")
mdi("G53 G1 X-30 F900")
time.sleep(1)
status.poll()
seen["refused"] = is_at(0)
home()
seen["homed"] = (pin("wificnc.locked"), [round(at, 3) for at in status.actual_position[:3]])
mdi("G53 G1 X-30 F900")
wait(lambda: is_at(-30))
mdi("G53 G1 X-50 F300")
wait(lambda: status.actual_position[0] < -31)
process = subprocess.run(["halcmd", "-s", "show", "comp", "wificnc"], capture_output=True, text=True).stdout.split()
os.kill(int(process[process.index("wificnc") + 1]), signal.SIGKILL)
wait(lambda: status.task_state != linuxcnc.STATE_ON)
command.state(linuxcnc.STATE_ON)
time.sleep(1)
status.poll()
seen["killed"] = status.task_state != linuxcnc.STATE_ON
pathlib.Path("said").write_text(repr((seen, shown)))
"""
)


def serve(home: Path) -> Server:
    profile = load_machine(str(home / "small.toml"))
    settings = (*profile.settings_lines(), "$76=20")
    options = ServeOptions(
        board=load_board("host"), wmc3=ADDRESS, control=0, settings=settings, store=home / "store", pty=home / "port"
    )
    return Server(options)


@contextmanager
def machine(home: Path, x_mm: float) -> Iterator[Server]:
    """A controller at power-on; the machine is this far from its left switch."""
    with serve(home) as server:
        hands(server, f"travel x {-x_mm} 90", "travel y -90 3", "travel z -90 3")
        yield server


def type_in(home: Path, keys: str) -> None:
    port = os.open(home / "port", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    os.write(port, keys.encode())
    time.sleep(0.1)
    os.close(port)


def follow(home: Path, is_done: Callable[[], bool]) -> None:
    """Do what LinuxCNC's side asks for."""
    asked = home / "config" / "do"
    with machine(home, 3):
        while not is_done():
            if asked.exists() and (what := asked.read_text()) == "off":
                break
            if asked.exists():
                type_in(home, what)
                asked.unlink()
            time.sleep(0.01)
    if is_done():
        return
    asked.unlink()
    while not asked.exists() and not is_done():
        time.sleep(0.01)
    with machine(home, 30):
        asked.unlink(missing_ok=True)
        while not is_done():
            time.sleep(0.01)


STOPPED = "The servo thread stopped"  # of a computer that is busy: not what this is about


def session(home: Path, as_user: Callable[..., str]) -> tuple[dict[str, Any], list[str]]:
    """All of it, once. @return what LinuxCNC's side has seen and shown"""
    home.mkdir(mode=0o777)
    home.chmod(0o777)
    (home / "small.toml").write_text(MACHINE)
    config = home / "config"
    invoke("init", str(home / "small.toml"), "--to", ADDRESS, "--out", str(config))
    text = (config / "small.ini").read_text().replace("DISPLAY = axis", "DISPLAY = ./screen.py")
    # LinuxCNC without real time, on a computer that is busy with tests, may be late by seconds
    text = "\n".join(
        "MIN_FERROR = 900" if line.startswith(("FERROR", "MIN_FERROR")) else line for line in text.split("\n")
    )
    (config / "small.ini").write_text(text)
    (config / "screen.py").write_text(SCREEN)
    fake_tool_change(config)
    for path in (config, *config.iterdir()):
        path.chmod(0o777)
    with serve(home):
        pass  # its settings are kept: from now on it is locked at power-on
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(as_user, "linuxcnc", "-r", str(config / "small.ini"))
        follow(home, running.done)
        running.result()
    seen, shown = ast.literal_eval((config / "said").read_text())
    return seen, shown


# Minutes of all of LinuxCNC; test_linuxcnc_config.py has one such session, link_bench.py these faults in virtual time.
@pytest.mark.deep
def test_a_controller_that_is_held_and_loses_its_power(user_home: Path, as_user: Callable[..., str]) -> None:
    for attempt in range(3):
        try:
            seen, shown = session(user_home / f"session-{attempt}", as_user)
        except AssertionError as error:
            if STOPPED not in str(error) or attempt == 2:
                raise
            continue
        if not any(STOPPED in text for text in shown):
            break
    assert seen == {
        "waits": True,
        "off": True,
        "unhomed": ("TRUE", "TRUE"),
        "latched": True,
        "locked": "TRUE",
        "refused": True,
        "homed": ("FALSE", [-59.0, -1.0, -1.0]),
        "killed": True,
    }
    for words in ("Feed hold", "No connection", "lost its position", "locked until"):
        assert any(words in text for text in shown), (words, shown)
    assert not any("amplifier" in text or "following error" in text for text in shown), shown
