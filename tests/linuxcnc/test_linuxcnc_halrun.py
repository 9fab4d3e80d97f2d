"""The component in LinuxCNC's own halrun moves a machine to the exact step."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from wificnc.board.load import load_board
from wificnc.serve.options import ServeOptions
from wificnc.serve.server import Server
from wificnc.wmc3.device import Device

ADDRESS = f"127.61.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
PYTHON = "/usr/bin/python3"  # LinuxCNC's modules are the system's
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))
# target, and where the joints stand in the end, units; limit3 keeps 50 units/s and 400 units/s2
HAL = """
loadrt limit3 count=3
loadrt integ count=1
loadusr -Wn wificnc {python} -m wificnc.linuxcnc --address {address} --joints 3
loadrt threads name1=servo period1=1000000
{joints}
addf integ.0 servo
setp integ.0.in 1
net time integ.0.out => wificnc.servo-time
start
loadusr -w sleep 1
setp wificnc.enable 1
loadusr -w sleep 0.5
{moves}
loadusr -w sleep 3
getp wificnc.joint.0.position-fb
getp wificnc.joint.1.position-fb
getp wificnc.connected
getp wificnc.fault
getp wificnc.underruns
setp wificnc.spindle-rpm 700
setp wificnc.spindle-on 1
setp wificnc.digital-out-02 1
loadusr -w sleep 0.3
"""
JOINT = """addf limit3.{n} servo
setp limit3.{n}.maxv 50
setp limit3.{n}.maxa 400
setp wificnc.joint.{n}.scale {scale}
net cmd{n} limit3.{n}.out => wificnc.joint.{n}.position-cmd"""


def test_joints_arrive_to_the_step(user_home: Path, as_user: Callable[..., str]) -> None:
    joints = "\n".join(JOINT.format(n=n, scale=(200, -200, 333.3)[n]) for n in range(3))
    moves = "setp limit3.0.in 20.003\nsetp limit3.1.in -7.5\nsetp limit3.2.in 3.3333"
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=SETTINGS)):
        script = user_home / "test.hal"
        script.write_text(HAL.format(python=PYTHON, address=ADDRESS, joints=joints, moves=moves))
        said = as_user("halrun", "-f", str(script))
        with Device(ADDRESS) as device:
            status = list(device.reports(0.3))[-1]
    assert status.position_steps[:3] == (round(20.003 * 200), round(7.5 * 200), round(3.3333 * 333.3))
    x, y, connected, fault, underruns = said.split()[-5:]
    assert float(x) == pytest.approx(20.003, abs=0.5 / 200) and float(y) == pytest.approx(-7.5, abs=0.5 / 200)
    assert (connected, fault, underruns) == ("TRUE", "FALSE", "0")
    assert status.misc_outputs == 0b100, "outputs stay; the spindle stops with the component's connection"
    assert status.spindle == 0
