"""The component in LinuxCNC's own halrun moves a machine to the exact step."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from itertools import islice
from pathlib import Path

import pytest
from wificnc.board.load import load_board
from wificnc.serve.options import ServeOptions
from wificnc.serve.server import Server
from wificnc.wmc3.device import Device
from wificnc.wmc3.layout import Segment, Status

ADDRESS = f"127.61.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
PYTHON = "/usr/bin/python3"  # LinuxCNC's modules are the system's
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 500)) for ax in range(3))
# limit3 keeps 50 units/s and 400 units/s2
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
loadusr -w {wait} ready TRUE
setp wificnc.enable 1
loadusr -w {wait} queue-ms 1-
{moves}
loadusr -w {wait} joint.0.position-fb 20.0 joint.1.position-fb -7.5 joint.2.position-fb 3.33
getp wificnc.joint.0.position-fb
getp wificnc.joint.1.position-fb
getp wificnc.connected
getp wificnc.fault
getp wificnc.underruns
setp wificnc.spindle-rpm 700
setp wificnc.spindle-on 1
setp wificnc.digital-out-02 1
loadusr -w {wait} spindle-at-speed TRUE
"""
# until pins are: "pin value ..."; a value is a begin of the pin's, 1- any that is not 0
WAIT = """#!/bin/sh
for try in $(seq 300); do
    missing=
    for word; do
        case $pin in
        "") pin=$word; continue ;;
        esac
        value=$(halcmd getp wificnc.$pin)
        case $word in
        1-) [ "$value" != 0 ] || missing=$pin ;;
        *) case $value in "$word"*) ;; *) missing=$pin ;; esac ;;
        esac
        pin=
    done
    [ -n "$missing" ] || exit 0
    sleep 0.05
done
echo "$missing is $value" >&2
exit 1
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
        wait = user_home / "wait.sh"
        wait.write_text(WAIT)
        wait.chmod(0o755)
        script.write_text(HAL.format(python=PYTHON, address=ADDRESS, joints=joints, moves=moves, wait=wait))
        said = as_user("halrun", "-f", str(script))
        with Device(ADDRESS) as device:
            status = list(device.reports(0.3))[-1]
    assert status.position_steps[:3] == (round(20.003 * 200), round(7.5 * 200), round(3.3333 * 333.3))
    x, y, connected, fault, underruns = said.split()[-5:]
    assert float(x) == pytest.approx(20.003, abs=0.5 / 200) and float(y) == pytest.approx(-7.5, abs=0.5 / 200)
    assert (connected, fault, underruns) == ("TRUE", "FALSE", "0")
    assert status.misc_outputs == 0b100, "outputs stay; the spindle stops with the component's connection"
    assert status.spindle == 0


def test_several_controllers_of_one_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Status reports of all of them come to one port; every component hears its own."""
    first, _, last = ADDRESS.rpartition(".")
    addresses = [f"{first}.{last}", f"{first.replace('127.61', '127.62')}.{last}"]
    monkeypatch.setattr("wificnc.wmc3.device._local_address", lambda device: ADDRESS.replace("127.61", "127.63"))
    with ExitStack() as stack:
        for address in addresses:
            stack.enter_context(Server(ServeOptions(board=load_board("host"), wmc3=address, settings=SETTINGS)))
        devices = [stack.enter_context(Device(address)) for address in addresses]
        for steps, device in enumerate(devices, start=1):
            device.listen(alone=False)
            device.stream([Segment((steps, 0, 0, 0, 0, 0), 10_000)])
        heard = {
            address: {status.position_steps[0] for status in _newest(device)}
            for address, device in zip(addresses, devices, strict=True)
        }
    assert heard == {addresses[0]: {1}, addresses[1]: {2}}


def _newest(device: Device) -> list[Status]:
    """The second report from now on: the first may be older than the motion."""
    return list(islice(device.reports(5), 1, 3))
