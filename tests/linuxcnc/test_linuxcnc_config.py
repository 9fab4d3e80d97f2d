"""`wificnc linuxcnc init`, and LinuxCNC itself with what it writes."""

from __future__ import annotations

import ast
import configparser
import os
import re
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from patience import HANG_S
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device
from wificnc.errors import RefusedError, UserError
from wificnc.linuxcnc.config import files, following_error, messages
from wificnc.profile import load_machine
from wificnc.profile.load import find_machines
from wificnc.profile.model import Machine
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

ADDRESS = f"127.60.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
MACHINE = """schema = 1
name = "small"
[spindle]
encoder_counts = 4096
max_rpm = 10000.0
[homing]
enabled = true
seek_mm_min = 1500.0
feed_mm_min = 300.0
debounce_ms = 25
pull_off_mm = 1.0
[axis.x]
steps_per_mm = 800.0
max_rate_mm_min = 3000.0
acceleration_mm_s2 = 500.0
travel_mm = 60.0
home_at = "min"
[axis.y]
steps_per_mm = 800.0
max_rate_mm_min = 3000.0
acceleration_mm_s2 = 500.0
travel_mm = 60.0
home_at = "max"
[axis.z]
steps_per_mm = 800.0
max_rate_mm_min = 3000.0
acceleration_mm_s2 = 500.0
travel_mm = 60.0
home_at = "max"
"""
# what a user would do at the screen, and where it leads; what it says last is where the probe has touched
# For programs that play the operator; they have command, status and wait().
SWITCH = """def switch(state):
    # again, as an operator does: until the link is up LinuxCNC stays in its e-stop
    def is_there():
        if status.task_state != state:
            command.state(state)
            command.wait_complete()
        return status.task_state == state
    wait(is_there)
"""

PROGRAM = (
    """#!/usr/bin/python3
import linuxcnc, pathlib, time
command, status = linuxcnc.command(), linuxcnc.stat()
def wait(what, most_s=300):
    end = time.monotonic() + most_s
    while status.poll() or not what():
        assert time.monotonic() < end, "timeout"
        time.sleep(0.02)
"""
    + SWITCH
    + """switch(linuxcnc.STATE_ESTOP_RESET)
switch(linuxcnc.STATE_ON)
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
errors, said = linuxcnc.error_channel(), []
wait(lambda: said.extend(errors.poll() or ()) or said)
assert said[1].strip() == "The controller is locked until all axes are homed.", said
command.home(-1)
wait(lambda: all(status.homed[:3]) and status.inpos)
homed = status.position[:3]
command.mode(linuxcnc.MODE_MDI)
command.wait_complete()
for line in (
    "G21 G90 G0 X-50 Y-10", "M62 P2", "M3 S700", "G1 X-40.5 Z-4 F1200", "G38.2 Z-30 F300", "G0 Z-4",
    "G33 Z-6 K0.5", "M66 P1 L0", "M5", "T1 M6", "G2 X-30.5 I5 F1200", "G0 X-31.23 Y-4.56 Z-7.89",
):
    command.mdi(line)
    assert command.wait_complete(300) == linuxcnc.RCS_DONE, line
    error = errors.poll()
    assert error is None, (line, error)
wait(lambda: all(abs(a - b) < 0.002 for a, b in zip(status.actual_position, (-31.23, -4.56, -7.89))))
pathlib.Path("said").write_text(repr((homed, status.probed_position[:3], status.probe_tripped, list(status.din[:4]))))
"""
)


# instead of the one that needs a screen: its operator presses Continue immediately
TOOL_CHANGE = """#!/usr/bin/python3
import hal, pathlib, time
change = hal.component("hal_manualtoolchange")
change.newpin("number", hal.HAL_S32, hal.HAL_IN)
change.newpin("change", hal.HAL_BIT, hal.HAL_IN)
change.newpin("changed", hal.HAL_BIT, hal.HAL_OUT)
change.ready()
while True:
    if change["change"] and not change["changed"]:
        pathlib.Path("tool").write_text(str(change["number"]))
    change["changed"] = change["change"]
    time.sleep(0.02)
"""


def invoke(*arguments: str) -> str:
    result = CliRunner().invoke(root, ["linuxcnc", *arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


@pytest.mark.alike(4)
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


def worst_ratio(velocity: float, acceleration: float, most: float, least: float, late_s: float) -> float:
    """Up to top speed, on, and back to rest; the feedback is the command of late_s ago. The following error by its
    limit, as LinuxCNC computes that from the commanded speed."""
    up_s, dt = velocity / acceleration, 0.001
    total_s = 2 * up_s + 2 * late_s

    def speed(t: float) -> float:
        return max(0.0, min(velocity, acceleration * t, acceleration * (total_s - t)))

    places = [0.0]
    for n in range(round((total_s + late_s) / dt)):
        places.append(places[-1] + speed(n * dt) * dt)
    late = round(late_s / dt)
    errors = [at - places[max(0, n - late)] for n, at in enumerate(places)]
    return max(error / max(least, most * speed(n * dt) / velocity) for n, error in enumerate(errors))


@pytest.mark.parametrize("velocity", [0.5, 10, 50, 83.3, 200, 500])
@pytest.mark.parametrize("acceleration", [10, 100, 400, 3000])
def test_following_error_allows_the_lag_and_little_more(velocity: float, acceleration: float) -> None:
    """Queue 0.1 s, report 0.05 s, network 0.05 s; 0.15 s until LinuxCNC waits, and two reports that are lost then."""
    most, least = following_error(velocity, acceleration)
    assert worst_ratio(velocity, acceleration, most, least, 0.45) <= 1
    assert worst_ratio(velocity, acceleration, most, least, 0.5) > 1 or velocity < 2, "half a second is not hidden"
    assert least <= 0.45 * velocity + 0.2 and least <= most


@pytest.mark.parametrize("machine", find_machines())
def test_the_hal_file_has_an_estop_latch_and_asks_for_tools(machine: str) -> None:
    hal = files("test", ADDRESS, load_machine(machine))["test.hal"]
    nets = {line.split()[1]: line.split()[2:] for line in hal.splitlines() if line.startswith("net ")}
    assert "iocontrol.0.emc-enable-in" in nets["estop-ok"] and "estop-latch.0.ok-out" in nets["estop-ok"]
    assert "motion.feed-inhibit" in nets["feed-inhibit"] and "wificnc.feed-inhibit" in nets["feed-inhibit"]
    assert not any({"iocontrol.0.tool-change", "iocontrol.0.tool-changed"} <= set(net) for net in nets.values())
    for joint in range(len(list(load_machine(machine).axis.present()))):
        assert f"halui.joint.{joint}.unhome" in nets[f"unhome-{joint}"]
        assert f"wificnc.joint.{joint}.homed" in nets[f"homed-{joint}"]


def test_messages_fit_into_a_hal_file() -> None:
    """Each pin of the component has its text; a comma would begin the next one."""
    texts = messages()
    hal = files("test", ADDRESS, load_machine("shapeoko3"))["test.hal"]
    assert len(texts) > 10 and set(texts) == set(re.findall(r"wificnc\.message\.([\w-]+)", hal))
    assert not any(character in text for text in texts.values() for character in ',"$[]')
    [names, words] = re.findall(r'^loadrt message names=(\S+) messages="([^"]*)"$', hal, re.MULTILINE)[0]
    assert len(names.split(",")) == len(words.split(",")) == len(texts)


@pytest.mark.parametrize("machine", find_machines())
def test_every_pin_of_the_sampler_is_connected_once(machine: str) -> None:
    """Commanded positions joint by joint, the thread's time, the kind of motion: in this order the component reads."""
    joints = len(list(load_machine(machine).axis.present()))
    hal = files("test", ADDRESS, load_machine(machine))["test.hal"]
    assert re.findall(r"loadrt sampler .* cfg=(\w+)$", hal, re.MULTILINE) == ["f" * joints + "fs"]
    sources = dict(re.findall(r"^net \S+ (\S+) => sampler\.0\.pin\.(\d+)$", hal, re.MULTILINE))
    assert sources == {f"joint.{n}.motor-pos-cmd": str(n) for n in range(joints)} | {
        "integ.0.out": str(joints),
        "motion.motion-type": str(joints + 1),
    }
    order = [hal.index(f"addf {name}") for name in ("motion-controller", "integ.0", "sampler.0")]
    assert order == sorted(order), "what it samples is of the same period"


def test_a_missing_component_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    said = invoke("init", "baseline", "--to", "127.0.0.1", "--out", str(tmp_path / "config"))
    assert "wificnc linuxcnc component --install" in said
    (tmp_path / "wificnc-hal").write_text("#!/bin/sh\n")
    (tmp_path / "wificnc-hal").chmod(0o755)
    assert "component --install" not in invoke(
        "init", "baseline", "--to", "127.0.0.1", "--out", str(tmp_path / "config"), "--force"
    )


@pytest.mark.parametrize("found", [["192.168.1.7"], [], ["192.168.1.7", "192.168.1.8"]])
def test_the_only_controller_is_taken(found: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wificnc.commands.linuxcnc.find_devices", lambda _: [(address, None) for address in found])
    arguments = ("init", "baseline", "--out", str(tmp_path))
    if len(found) == 1:
        invoke(*arguments)
        assert "ADDRESS = 192.168.1.7" in (tmp_path / "baseline.ini").read_text()
    else:
        with pytest.raises(UserError, match=r"no controller answers|2 controllers answer: 192.168.1.7, 192.168.1.8"):
            invoke(*arguments)
        assert not list(tmp_path.iterdir())


def test_an_address_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="'controller' is not an IPv4 address"):
        invoke("init", "baseline", "--to", "controller", "--out", str(tmp_path))
    assert not list(tmp_path.iterdir())


def test_a_configuration_is_paired_once_the_controller_has_accepted_the_key(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no address of a controller"):
        invoke("pair", str(tmp_path), "--key", "right")
    invoke("init", "baseline", "--to", ADDRESS, "--out", str(tmp_path))
    assert "--key-file [WIFICNC]KEY_FILE" in (tmp_path / "baseline.hal").read_text()
    path = tmp_path / "access.key"
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, key="right")):
        with pytest.raises(RefusedError):
            invoke("pair", str(tmp_path), "--key", "wrong")
        assert not path.exists()
        invoke("pair", str(tmp_path), "--key", "right")
    assert path.read_text() == "right\n" and path.stat().st_mode & 0o777 == 0o600


def test_nothing_is_written_over(tmp_path: Path) -> None:
    arguments = ("init", "baseline", "--to", "127.0.0.1", "--out", str(tmp_path))
    invoke(*arguments)
    with pytest.raises(UserError, match="already exists"):
        invoke(*arguments)
    invoke(*arguments, "--force")


def test_axes_with_a_gap_are_refused() -> None:
    axis = {"steps_per_mm": 80.0, "max_rate_mm_min": 3000.0, "acceleration_mm_s2": 200.0}
    machine = Machine.model_validate({"schema": 1, "name": "gap", "axis": {"x": axis, "z": axis}})
    with pytest.raises(ValueError, match="without a gap"):
        files("gap", ADDRESS, machine)


def test_home_is_where_the_controller_stands_when_it_has_homed(tmp_path: Path) -> None:
    invoke("init", "diode_laser", "--home", "--to", "192.168.1.50", "--out", str(tmp_path))
    ini = configparser.ConfigParser(strict=False)
    ini.read(tmp_path / "diode_laser.ini")
    assert [float(ini[f"JOINT_{n}"]["HOME"]) for n in range(3)] == [-397, -397, -47], "home at the low end, 3 mm off"
    assert all(ini[f"JOINT_{n}"]["HOME_USE_INDEX"] == "YES" for n in range(3))
    assert all(float(ini[f"JOINT_{n}"]["HOME_LATCH_VEL"]) > 0 for n in range(3))


@pytest.mark.slow
def test_linuxcnc_moves_a_machine_to_the_step(user_home: Path, as_user: Callable[..., str]) -> None:
    """All of LinuxCNC 2.9 with the written configuration, only its screen is ours: homing, probing, a thread, an input.

    The controller is locked, as at power-on, and LinuxCNC's operator gets a message, once. The machine is 3 mm from its
    switches, which are at machine X-60, Y0 and Z0; the probe touches 9.2 mm below that of Z. Without pulses of an
    encoder and its index G33 would wait for ever.
    """
    (user_home / "small.toml").write_text(MACHINE)
    profile = load_machine(str(user_home / "small.toml"))
    invoke("init", str(user_home / "small.toml"), "--to", ADDRESS, "--out", str(user_home / "config"))
    ini = user_home / "config" / "small.ini"
    text = ini.read_text().replace("DISPLAY = axis", "DISPLAY = ./screen.py")
    # LinuxCNC without real time, on a computer that is busy with tests, may be late by seconds
    ini.write_text("\n".join("MIN_FERROR = 900" if "FERROR" in line else line for line in text.splitlines()))
    screen = user_home / "config" / "screen.py"
    screen.write_text(PROGRAM)
    fake_tool_change(user_home / "config")
    settings = tuple(profile.settings_lines())
    options = ServeOptions(
        board=load_board("host"), wmc3=ADDRESS, control=0, settings=settings, key="k7qf3-x2m9d-0abcd"
    )
    with Server(options) as server:
        invoke("pair", str(user_home / "config"), "--key", "K7QF3X2M9D0ABCD")
        for path in (user_home / "config", *(user_home / "config").iterdir()):
            path.chmod(0o777)
        hands(server, "travel x -3 90", "travel y -90 3", "travel z -90 3", "surface -6.2", "input 2 on")
        as_user("linuxcnc", "-r", str(ini))
        with Device(ADDRESS) as device:
            status = next(device.reports(HANG_S))
    assert status.position_steps[:3] == tuple(round(mm * 800) for mm in (-31.23, -4.56, -7.89))
    homed, probed, tripped, inputs = ast.literal_eval((user_home / "config" / "said").read_text())
    assert homed == pytest.approx((-59, -1, -1), abs=0.5 / 800)
    # true Z 3 is the switch, machine Z 0
    assert tripped and probed == pytest.approx((-40.5, -10, -9.2), abs=0.5 / 800)
    assert status.misc_outputs == 0b100 and inputs == [0, 0, 1, 0]
    assert (user_home / "config" / "tool").read_text() == "1", "M6 asks the operator"


def fake_tool_change(config: Path) -> None:
    (config / "tool_change.py").write_text(TOOL_CHANGE)
    hal = config / "small.hal"
    usual = "loadusr -W hal_manualtoolchange"
    assert usual in hal.read_text()
    hal.write_text(hal.read_text().replace(usual, f"loadusr -Wn hal_manualtoolchange {config}/tool_change.py"))


def hands(server: Server, *lines: str) -> None:
    """What someone does at the machine."""
    assert server.control
    host, _, port = server.control.rpartition(":")
    with socket.create_connection((host, int(port)), HANG_S) as door, door.makefile("rw") as words:
        for line in lines:
            words.write(f"{line}\n")
            words.flush()
            assert words.readline().strip() == "ok", line
