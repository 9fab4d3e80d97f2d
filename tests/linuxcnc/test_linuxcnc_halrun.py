"""The component in LinuxCNC's own halrun moves machines to the exact step."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from itertools import islice
from pathlib import Path

import pytest
from esp_process import IMAGE, EspProcess
from halrun_file import SETTINGS, Rig, hal_file, serve, stands
from lossy import Lossy
from patience import HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.layout import Segment
from wificnc.linuxcnc.config import INPUT_COUNT, OUTPUT_COUNT

OWN = f"{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
ADDRESS, OTHER, LOCAL = f"127.61.{OWN}", f"127.62.{OWN}", f"127.63.{OWN}"
COUNTS = """getp wificnc.connected
getp wificnc.fault
getp wificnc.underruns
"""
END = f"""{COUNTS}setp wificnc.spindle-rpm 700
setp wificnc.spindle-on 1
setp wificnc.digital-out-02 1
loadusr -w {{wait}} wificnc spindle-at-speed TRUE
show pin wificnc
"""


def test_joints_arrive_to_the_step(user_home: Path, as_user: Callable[..., str]) -> None:
    targets = ((20.003, -7.5, 3.3333), (-1.0, 4.44, 0.0), (20.0, -7.5, 3.3333))
    late = "--queue-ms 500"  # no thread here is a real-time one, and other tests run, too
    rig = Rig("wificnc", ADDRESS, (200, -200, 333.3), targets, options=late)
    with serve(ADDRESS):
        said = as_user("halrun", "-f", hal_file(user_home, rig, then=END))
        status = stands(ADDRESS)
    assert status.position_steps[:3] == (4000, 1500, 1111) == rig.steps(rig.targets[-1])
    assert said.split()[:3] == ["TRUE", "FALSE", "0"], "connected, no fault, no underruns"
    assert status.misc_outputs == 0b100, "outputs stay; the spindle stops with the component's connection"
    assert status.spindle == 0
    check_pins(said)


if IMAGE:  # of an ESP32 with Ethernet, where someone has one (esp_process.py)

    def test_joints_of_a_chip_arrive_to_the_step(user_home: Path, as_user: Callable[..., str], tmp_path: Path) -> None:
        targets = ((20.003, -7.5, 3.3333), (-1.0, 4.44, 0.0), (20.0, -7.5, 3.3333))
        words = [word for line in SETTINGS for word in ("--set", line)]
        with EspProcess(tmp_path, "--wmc3", ADDRESS, *words) as process:
            key = process.options.key
            rig = Rig("wificnc", ADDRESS, (200, -200, 333.3), targets, options=f"--queue-ms 500 --key {key}")
            said = as_user("halrun", "-f", hal_file(user_home, rig, then=COUNTS))
            status = stands(ADDRESS, key)
        assert status.position_steps[:3] == (4000, 1500, 1111)
        assert said.split()[:3] == ["TRUE", "FALSE", "0"], "connected, no fault, no underruns"


def check_pins(said: str) -> None:
    """Pins as LinuxCNC shows them are those of the documentation and of the configurations."""
    rows = re.findall(r"^\s*\d+\s+(\w+)\s+(\S+)\s+\S+\s+wificnc\.(\S+)", said, re.MULTILINE)
    pins = {name: (kind, {"I/O": "io"}.get(direction, direction.lower())) for kind, direction, name in rows}
    families = {re.sub(r"\d\d", "NN", name.replace("joint.0", "joint.N")) for name in pins if "joint.1" not in name}
    families = {name for name in families if "joint.2" not in name}
    text = (checkout_root() / "docs" / "linuxcnc.md").read_text(encoding="utf-8")
    text = text[text.index("\n## The component") + 1 :].split("\n## ")[0]
    table = re.findall(r"^\| (`.+`) \| (bit|float|s32|u32) \| (in|out|io) \|", text, re.MULTILINE)
    documented = {name: (kind, way) for names, kind, way in table for name in re.findall(r"`([^`]+)`", names)}
    assert documented == {
        name: pins[name.replace("joint.N", "joint.0").replace("NN", "00")] for name in sorted(families)
    }
    assert {name for name in pins if name.startswith("digital-")} == {
        *(f"digital-out-{n:02}" for n in range(OUTPUT_COUNT)),
        *(f"digital-in-{n:02}" for n in range(INPUT_COUNT)),
        *(f"digital-in-{n:02}-not" for n in range(INPUT_COUNT)),
    }, "linuxcnc/config.py counts as the component does"


@pytest.mark.deep  # link_bench.py has the component on such a network, tests/wire the controller
def test_a_network_that_loses_doubles_and_reorders(user_home: Path, as_user: Callable[..., str]) -> None:
    """Not one step is lost or made twice, also where the way turns back. That it may be slow is not asserted."""
    targets = ((12.34, -5.0, 3.0), (0.5, 0.0, 3.0), (12.345, -5.01, -3.005), (0.0, 0.0, 0.0), (7.77, -3.33, 1.0))
    rig = Rig("wificnc", OTHER, (200, 200, 200), targets, options="--queue-ms 300")
    with serve(ADDRESS):
        with Lossy(ADDRESS, OTHER, loss=0.3, duplicate=0.3, delay_ms=(0.0, 20.0), local=LOCAL) as network:
            as_user("halrun", "-f", hal_file(user_home, rig))
            ways = (network.to_device, network.to_host)
        assert stands(ADDRESS).position_steps[:3] == (1554, -666, 200) == rig.steps(targets[-1])
    for way in ways:
        assert min(way.lost, way.doubled, way.overtaken) > 20, "the network was bad"


# joint 0 and then joint 1 move while the component does not get its turn
HELD_UP = """#!/bin/sh
set -e
component=$(halcmd -s show comp wificnc | awk '$3 == "wificnc" { print $4 }')
kill -STOP "$component"
for joint in 0 1; do
    halcmd setp limit3.$joint.in 1.5
    until [ "$(halcmd getp limit3.$joint.out)" = 1.5 ]; do sleep 0.02; done
    sleep 0.02
done
kill -CONT "$component"
"""


@pytest.mark.deep  # link_bench.py has the same corner, in virtual time (test_linuxcnc_link.py)
def test_a_component_that_is_late_cuts_no_corner(
    user_home: Path, as_user: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is stopped for some tenths of a second, around a corner: the sampler has kept every period of that."""
    monkeypatch.setattr("wificnc.connection.wmc3.device._local_address", lambda device: LOCAL)
    held_up = user_home / "held_up.sh"
    held_up.write_text(HELD_UP)
    held_up.chmod(0o755)
    rig = Rig("wificnc", ADDRESS, (200, 200), ((0.005, 0.005),))
    corner = Rig("wificnc", ADDRESS, (200, 200), ((1.5, 1.5),))
    then = f"loadusr -w {held_up}\nloadusr -w {{wait}} wificnc {corner.feedback((1.5, 1.5))}\n"
    with serve(ADDRESS), Device(ADDRESS) as device, ThreadPoolExecutor(1) as pool:
        device.listen(alone=False)
        script = hal_file(user_home, rig, then=then)
        run = pool.submit(as_user, "halrun", "-f", script)
        places = []
        while not run.done():
            places += [report.position_steps[:2] for report in islice(device.reports(HANG_S), 20)]
        run.result()
    on_the_way = [place for place in places if place != (1, 1)]
    assert places[-1] == (300, 300)
    assert [(x, y) for x, y in on_the_way if x > 1 and y > 1 and x < 300] == [], "first one joint, and then the other"
    for joint in (0, 1):
        assert len({place[joint] for place in on_the_way} - {0, 1, 300}) > 3, "it was looked at"


def test_two_controllers_two_components(user_home: Path, as_user: Callable[..., str]) -> None:
    """One LinuxCNC, one thread: each component has its own sampler, and its name before its pins."""
    rigs = (
        Rig("wificnc.0", ADDRESS, (200, 200), ((5.0, -2.5), (10.01, 3.0))),
        Rig("wificnc.1", OTHER, (200, 200, -100), ((-4.0, 2.0, 1.0), (8.02, -1.0, 2.5))),
    )
    with serve(ADDRESS), serve(OTHER):
        as_user("halrun", "-f", hal_file(user_home, *rigs))
        first, second = stands(ADDRESS), stands(OTHER)
    assert first.position_steps[:3] == (2002, 600, 0)
    assert second.position_steps[:3] == (1604, -200, -250)


def test_several_controllers_of_one_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Status reports of all of them come to one port; every host program hears its own."""
    addresses = [ADDRESS, OTHER]
    monkeypatch.setattr("wificnc.connection.wmc3.device._local_address", lambda device: LOCAL)
    with ExitStack() as stack:
        for address in addresses:
            stack.enter_context(serve(address))
        devices = [stack.enter_context(Device(address)) for address in addresses]
        for steps, device in enumerate(devices, start=1):
            device.listen(alone=False)
            device.stream([Segment((steps, 0, 0, 0, 0, 0), 10_000)])
        heard = [_places_until(device, steps) for steps, device in enumerate(devices, start=1)]
    assert [places - {0} for places in heard] == [{1}, {2}]


def _places_until(device: Device, steps: int) -> set[int]:
    """Where X stood in all reports up to the second one that has it there: earlier ones are older than the motion."""
    heard: set[int] = set()
    arrived = 0
    for status in device.reports(HANG_S):
        heard.add(status.position_steps[0])
        arrived += status.position_steps[0] == steps
        if arrived == 2:
            break
    return heard
