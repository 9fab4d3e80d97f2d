"""An I/O module as LinuxCNC's pins: in virtual time, and in halrun."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from component_library import AWAIT, RANDOM, SAY, SEND, World, library, numbered
from link_bench import Pins, Wire
from test_module import CONFIG, COUNT, DIRECTION, HIGH, LOW, PIN, SAFE, Module
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.connection.wmc3.channels import Change, configure
from wificnc.connection.wmc3.device import Device, find_key, pack_value
from wificnc.connection.wmc3.layout import LISTENER_S, ChannelOutputs, ConfigSet
from wificnc.linuxcnc.source import PROGRAM
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server
from wire_device import OTHER
from wire_device import Device as VirtualDevice

TICK_S = 0.01


class Bench:
    """A module and its component. Time advances by run()."""

    def __init__(self, virtual: VirtualDevice, key: str = "") -> None:
        self.lib, self.virtual, self.wire = library(), virtual, Wire(virtual)
        self.key = key.encode()
        self.said: list[str] = []
        self.lost: str | None = None
        self.pins = Pins(self.lib.component_module_pins(), self.lib.module_make_pins)
        self.module: int = self.lib.component_module()
        self._world = World(
            None,
            SEND(self.wire.datagram),
            SEND(self.wire.control),
            RANDOM(numbered),
            AWAIT(lambda _: None),
            SAY(self._say),
        )
        self.connect()

    def _say(self, _ctx: object, text: bytes) -> None:
        self.said.append(text.decode())

    def connect(self) -> None:
        self.lost = None
        self.lib.module_begin(self.module, self.pins.handle, self._world, self.key, self.virtual.now)

    def run(self, seconds: float, tick_s: float = TICK_S) -> None:
        for _ in range(round(seconds / tick_s)):
            self.virtual.run(tick_s)
            now, peer = self.virtual.now, self.lib.component_module_peer(self.module)
            for data in self.wire.heard():
                self.lib.peer_hear_udp(peer, data, len(data), now)
            while self.wire.answers and not self.wire.is_slow:
                data = self.wire.answers.pop(0)
                self.lib.peer_hear_tcp(peer, data, len(data), now)
            if self.lost is None and (lost := self.lib.module_tick(self.module, now)):
                self.lost = lost.decode()
                self.lib.module_lose(self.pins.handle)

    def switch(self, **channels: bool) -> None:
        """out_08=True: pin channel-08-out."""
        for name, on in channels.items():
            self.pins[f"channel-{name[-2:]}-out"] = on

    @property
    def inputs(self) -> int:
        """Mask of the channels that are on; the `-not` pins say the same."""
        mask = sum(self.pins[f"channel-{n:02}-in"] << n for n in range(16))
        assert mask ^ 0xFFFF == sum(self.pins[f"channel-{n:02}-in-not"] << n for n in range(16))
        return mask


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    """Channels 0 to 7 are inputs on pins 0 to 7, 8 to 15 outputs on pins 8 to 15."""
    made: list[VirtualDevice] = []

    def bench(config: dict[int, int] | None = None, key: str = "", said: str | None = None) -> Bench:
        made.append(Module(str(tmp_path / f"store{len(made)}"), config, key))
        return Bench(made[-1], key if said is None else said)

    yield bench
    for each in made:
        each.close()


def test_inputs(make: Callable[..., Bench]) -> None:
    bench = make()
    for pin in (1, 3):
        bench.virtual.hold(pin, HIGH)
    bench.virtual.hold(0, LOW)
    bench.run(0.3)
    assert bench.pins["connected"] and bench.pins["estop-ok"] and not bench.pins["fault"]
    assert bench.inputs & 0b1011 == 0b1010
    bench.virtual.hold(3, LOW)
    bench.run(0.3)
    assert bench.inputs & 0b1011 == 0b0010


def test_outputs_are_what_the_pins_say(make: Callable[..., Bench]) -> None:
    bench = make()
    bench.switch(out_08=True, out_15=True, out_02=True)
    bench.run(0.2)
    assert bench.virtual.levels == 1 << 8 | 1 << 15, "channel 2 is an input: its pin means nothing"
    bench.switch(out_08=False, out_09=True)
    bench.run(0.05)
    assert bench.virtual.levels == 1 << 9 | 1 << 15 and not bench.pins["fault"] and bench.said == []


def test_a_channel_without_a_pin_keeps_none_of_the_others_from_being_switched(make: Callable[..., Bench]) -> None:
    bench = make({**CONFIG, PIN + 9: 0xFF})
    bench.switch(out_08=True, out_09=True)
    bench.run(0.2)
    assert bench.virtual.levels == 1 << 8 and not bench.pins["fault"]


def test_channels_that_are_not_in_use_are_left_alone(make: Callable[..., Bench]) -> None:
    bench = make({COUNT: 4, DIRECTION: 0xFFFF, **{PIN + n: n for n in range(4)}})
    bench.switch(out_03=True, out_04=True)
    bench.run(0.2)
    assert bench.virtual.levels == 1 << 3 and not bench.pins["fault"]


def test_what_it_said_is_not_said_again(make: Callable[..., Bench]) -> None:
    """By TCP: it is answered, and there is nothing to repeat."""
    bench = make()
    bench.switch(out_08=True)
    bench.run(3)
    assert sum(isinstance(packet.payload, ChannelOutputs) for packet in bench.wire.requests) == 1
    assert bench.pins["connected"], "and its reports still come"


def test_an_output_that_changes_often_does_not_end_a_slow_connection(make: Callable[..., Bench]) -> None:
    """Every 10 ms, while the network keeps answers back for 0.5 s. Then the newest state counts."""
    bench = make()
    bench.run(0.2)
    bench.wire.is_slow = True
    for n in range(50):
        bench.switch(out_08=n % 2 == 0, out_09=True)
        bench.run(TICK_S)
    bench.wire.is_slow = False
    bench.run(0.1)
    assert bench.lost is None and bench.virtual.levels == 1 << 9


def test_reports_still_come_after_an_hour(make: Callable[..., Bench]) -> None:
    """The module forgets who has sent no datagram for this time; requests are none."""
    bench = make()
    client = bench.virtual.connect()
    key, row = find_key("status_interval_ms")
    bench.virtual.request(client, ConfigSet(key, *pack_value(row, "900")))
    bench.run(LISTENER_S + 100, tick_s=0.9)
    assert bench.pins["connected"] and bench.lost is None


def test_estop_makes_outputs_safe_and_a_reset_gives_them_back(make: Callable[..., Bench]) -> None:
    bench = make({**CONFIG, SAFE: 1 << 12})
    bench.switch(out_08=True)
    bench.run(0.2)
    bench.pins["estop"] = True
    bench.run(0.2)
    assert bench.virtual.levels == 1 << 12
    assert bench.pins["estopped"] and not bench.pins["estop-ok"] and not bench.pins["fault"]
    bench.pins["estop"] = False
    bench.run(1)
    assert bench.virtual.levels == 1 << 12, "until someone says so"
    bench.pins["reset"] = True
    bench.run(0.3)
    assert bench.virtual.levels == 1 << 8 and bench.pins["estop-ok"]


def test_another_host_commands(make: Callable[..., Bench]) -> None:
    bench = make()
    bench.virtual.change(LOST=0)
    other = bench.virtual.connect(OTHER)
    bench.virtual.request(other, ChannelOutputs(1 << 10, 1 << 10))
    bench.switch(out_08=True)
    bench.run(1)
    assert bench.pins["fault"] and bench.virtual.levels == 1 << 10
    assert len(bench.said) == 1, "once, and not each time that it tries again"
    assert bench.said[0].startswith("the module refuses to switch its outputs: another host is in control")
    bench.virtual.disconnect(other)
    bench.run(6)
    assert not bench.pins["fault"] and bench.virtual.levels & 1 << 8, "it has tried again"
    assert len(bench.said) == 1, "that it is done is no refusal"


def test_a_module_that_goes_and_comes_back(make: Callable[..., Bench]) -> None:
    bench = make()
    bench.virtual.hold(1, HIGH)
    bench.switch(out_08=True)
    bench.run(0.3)
    bench.wire.dead = True
    bench.run(2)
    assert bench.lost and not bench.pins["connected"] and not bench.pins["estop-ok"]
    assert bench.inputs & 2, "inputs stay as they were known last"
    bench.wire.dead = False
    bench.switch(out_08=False, out_09=True)
    bench.connect()
    bench.run(0.3)
    assert bench.pins["connected"] and bench.virtual.levels == 1 << 9


@pytest.mark.parametrize("said", ["", "wrong"])
def test_a_wrong_key(make: Callable[..., Bench], said: str) -> None:
    bench = make(key="right", said=said)
    bench.switch(out_08=True)
    bench.run(0.2)
    assert bench.lost and "wificnc linuxcnc pair" in bench.lost and bench.virtual.levels == 0


def test_a_key(make: Callable[..., Bench]) -> None:
    bench = make(key="right")
    bench.switch(out_08=True)
    bench.run(0.2)
    assert bench.virtual.levels == 1 << 8


def test_a_motion_controller_is_no_module() -> None:
    device = VirtualDevice()
    bench = Bench(device)
    bench.run(0.1)
    assert bench.lost == "this is a motion controller, no I/O module: leave --io-module out"
    device.close()


# ---- with LinuxCNC ----

ADDRESS = f"127.67.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
HAL = """loadusr -Wn io {program} --io-module --name io --address {address}
setp io.channel-01-out 1
loadusr -w {wait} io connected TRUE estop-ok TRUE fault FALSE
show pin io
"""
WAIT = """#!/bin/sh
name=$1
shift
while [ $# -gt 0 ]; do
    try=0
    until [ "$(halcmd getp $name.$1)" = "$2" ]; do
        try=$((try + 1))
        [ $try -lt 100 ] || { echo "$name.$1 is not $2" >&2; exit 1; }
        sleep 0.05
    done
    shift 2
done
"""


def test_a_module_in_halrun(user_home: Path, as_user: Callable[..., str]) -> None:
    wait, script = user_home / "wait.sh", user_home / "test.hal"
    wait.write_text(WAIT)
    wait.chmod(0o755)
    script.write_text(HAL.format(program=PROGRAM, address=ADDRESS, wait=wait))
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, io_module=True)):
        with Device(ADDRESS) as device:
            for number, output in ((0, False), (1, True)):
                configure(device, number, Change(output=output, pin=number))
        said = as_user("halrun", "-f", str(script))
    rows = re.findall(r"^\s*\d+\s+(\w+)\s+(\S+)\s+\S+\s+io\.(\S+)", said, re.MULTILINE)
    pins = {re.sub(r"\d\d", "NN", name): (kind, way.lower()) for kind, way, name in rows}
    text = (checkout_root() / "docs" / "linuxcnc.md").read_text(encoding="utf-8")
    part = text[text.index("\n## I/O modules") + 1 :].split("\n## ")[0]
    table = re.findall(r"^\| (`.+`) \| (bit) \| (in|out) \|", part, re.MULTILINE)
    assert {name: (kind, way) for names, kind, way in table for name in re.findall(r"`([^`]+)`", names)} == pins
