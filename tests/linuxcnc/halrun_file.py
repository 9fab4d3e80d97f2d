"""Files for LinuxCNC's halrun that move machines by the component, and the controllers of those machines."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.connection.wmc3.device import Device
from wificnc.connection.wmc3.layout import State, Status
from wificnc.linuxcnc.source import PROGRAM
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

RATES = ((100, 200), (110, 6000), (120, 500))
# $74: what HAL has commanded is finished when its script, and so the component, ends
SETTINGS = (*(f"${base + ax}={value}" for base, value in RATES for ax in range(3)), "$74=0", "$76=10")
# until pins of a component are: "pin value ..."; 1- is any value but 0
WAIT = """#!/bin/sh
name=$1
shift
for try in $(seq 1200); do
    missing=
    for word; do
        case $pin in
        "") pin=$word; continue ;;
        esac
        value=$(halcmd getp $name.$pin)
        case $word in
        1-) [ "$value" != 0 ] || missing="$pin is $value" ;;
        *) [ "$value" = "$word" ] || missing="$pin is $value, not $word" ;;
        esac
        pin=
    done
    [ -n "$missing" ] || exit 0
    sleep 0.05
done
echo "$name: $missing" >&2
exit 1
"""
HEAD = """loadrt limit3 count={limits}
loadrt integ count=1
loadrt sampler depth={depths} cfg={kinds}
loadrt threads name1=servo period1=1000000
addf integ.0 servo
setp integ.0.in 1
"""
# limit3 keeps 50 units/s and 400 units/s2
JOINT = """addf limit3.{limit} servo
setp limit3.{limit}.maxv 50
setp limit3.{limit}.maxa 400
setp {name}.joint.{n}.scale {scale}
net cmd{limit} limit3.{limit}.out => sampler.{sampler}.pin.{n}
"""


@dataclass(frozen=True)
class Rig:
    """A component and the machine that it moves."""

    name: str
    address: str
    scales: tuple[float, ...]  # steps per unit of each joint
    targets: tuple[tuple[float, ...], ...]  # one after the other, units
    options: str = ""

    def steps(self, target: tuple[float, ...]) -> tuple[int, ...]:
        return tuple(round(at * scale) for at, scale in zip(target, self.scales, strict=True))

    def feedback(self, target: tuple[float, ...]) -> str:
        """What halcmd says of position-fb there, as WAIT wants it."""
        shown = (steps / scale for steps, scale in zip(self.steps(target), self.scales, strict=True))
        return " ".join(f"joint.{n}.position-fb {at:.7g}" for n, at in enumerate(shown))


def hal_file(folder: Path, *rigs: Rig, then: str = "", is_there: bool = True) -> str:
    """A file for halrun that moves them; its path. They move at the same time, each target when all are there.

    is_there: the controllers are, so that the components are enabled before `then`."""
    wait = folder / "wait.sh"
    wait.write_text(WAIT)
    wait.chmod(0o755)
    kinds = ["f" * len(rig.scales) + "fs" for rig in rigs]
    limits = [sum(len(rig.scales) for rig in rigs[:n]) for n in range(len(rigs) + 1)]
    text = HEAD.format(limits=limits[-1], depths=",".join("1000" for _ in rigs), kinds=",".join(kinds))
    for sampler, rig in enumerate(rigs):
        text += f"loadusr -Wn {rig.name} {PROGRAM} --name {rig.name} --address {rig.address} "
        text += f"--joints {len(rig.scales)} --sampler {sampler} {rig.options}\n"
        for n, scale in enumerate(rig.scales):
            text += JOINT.format(limit=limits[sampler] + n, n=n, scale=scale, name=rig.name, sampler=sampler)
        text += f"net time integ.0.out => sampler.{sampler}.pin.{len(rig.scales)}\naddf sampler.{sampler} servo\n"
    text += "start\n"
    if is_there:
        text += "".join(f"loadusr -w {wait} {rig.name} ready TRUE\n" for rig in rigs)
        text += "".join(f"setp {rig.name}.enable 1\n" for rig in rigs)
        text += "".join(f"loadusr -w {wait} {rig.name} queue-ms 1-\n" for rig in rigs)
    for turn in range(len(rigs[0].targets)):
        for sampler, rig in enumerate(rigs):
            text += "".join(f"setp limit3.{limits[sampler] + n}.in {at}\n" for n, at in enumerate(rig.targets[turn]))
        text += "".join(f"loadusr -w {wait} {rig.name} {rig.feedback(rig.targets[turn])}\n" for rig in rigs)
    script = folder / "test.hal"
    script.write_text(text + then.format(wait=wait))
    return str(script)


def serve(address: str) -> Server:
    return Server(ServeOptions(board=load_board("host"), wmc3=address, settings=SETTINGS))


def stands(address: str, key: str = "") -> Status:
    """Its report when it does not move any more."""
    with Device(address, key=key) as device:
        for before, after in pairwise(device.reports(HANG_S)):
            if before.position_steps == after.position_steps and after.state == State.IDLE:
                return after
    raise AssertionError("it does not stand")
