"""`wificnc wmc3`: a host of the binary protocol."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import rich_click as click
from rich.table import Table

from wificnc import ui
from wificnc.commands._finite import FiniteRange
from wificnc.commands._secret import ASKED, Secret
from wificnc.commands._target import json_option
from wificnc.connection.wmc3.channels import (
    MODULE_MODE,
    NO_PIN,
    Change,
    Channel,
    check_number,
    configure,
    read_channels,
    switch,
)
from wificnc.connection.wmc3.device import Device, find_devices, find_key, pack_value, value_hint
from wificnc.connection.wmc3.keys import KEYS, Key
from wificnc.connection.wmc3.layout import (
    Alarm,
    Capability,
    Estop,
    Hold,
    Home,
    Jog,
    Refusal,
    Reset,
    Resume,
    Segment,
    State,
    Statistics,
    StatisticsResponse,
    Status,
    StatusFlag,
)  # fmt: skip
from wificnc.connection.wmc3.measure import measure_reports, measure_trips, method
from wificnc.connection.wmc3.stream import StreamSender
from wificnc.errors import Exit, UserError

AXES = "XYZABC"
SLICE_S = 0.01
ON_TRIAL = ("wifi_ssid", "wifi_password", "host_name", "ip_mode", "ip_address", "ip_gateway", "ip_netmask")
SLICES_MAX = 100_000
STEPS_MAX = 0x7FFFFFFF

device_option = click.option(
    "--to",
    "address",
    envvar="WIFICNC_WMC3",
    show_envvar=True,
    default="127.0.0.1",
    show_default=True,
    metavar="ADDRESS",
    help="IPv4 address of the device.",
)
key_option = click.option(
    "--key",
    "access_key",
    envvar="WIFICNC_KEY",
    show_envvar=True,
    default="",
    type=Secret(),
    help="Access key, if the device is locked. " + ASKED,
)


def with_device(function: Callable[..., None]) -> Callable[..., None]:
    """--to and --key, for commands that get a Device."""

    @device_option
    @key_option
    @functools.wraps(function)
    def wrapped(*arguments: Any, address: str, access_key: str, **options: Any) -> None:
        with Device(address, access_key) as device:
            function(device, *arguments, **options)

    return wrapped


@click.group()
def command() -> None:
    """Control a device by the binary protocol (WMC3), as LinuxCNC and Mach3 do: docs/protocol.md."""


@command.command()
@with_device
@json_option
def handshake(device: Device, as_json: bool) -> None:
    """Show the device and its capabilities."""
    hello = device.handshake()
    version = f"{hello.version >> 24}.{hello.version >> 16 & 0xFF}.{hello.version & 0xFFFF}"
    names = [bit.name.lower() for bit in Capability if hello.capabilities & bit and bit.name]
    if as_json:
        ui.emit_json({**asdict(hello), "version": version, "capabilities": names})
        return
    motion = {
        "axes": hello.axes,
        "queue": f"{hello.buffer_capacity} segments",
        "step rate": f"{hello.step_rate_hz} steps/s",
    }
    mode = {"channels": hello.io_channels} if hello.device_mode == MODULE_MODE else motion
    _rows({"device": hello.device_name, "version": version, **mode, "can": ", ".join(names)})


@command.command()
@click.option("--seconds", type=FiniteRange(0.2, 60), default=3.0, show_default=True)
@click.option(
    "--broadcast", default="255.255.255.255", show_default=True, help="Broadcast address, or the address of one device."
)
@json_option
def discover(seconds: float, broadcast: str, as_json: bool) -> None:
    """Find devices by broadcast, including those of other manufacturers. Does not take control. Exit code 1 if none
    is found."""
    found = []
    for address, first in find_devices(seconds, broadcast):
        found.append({"address": address, "state": State(first.state).name.lower()})
        if not as_json:
            ui.data.print(f"{address}  {found[-1]['state']}")
    if as_json:
        ui.emit_json(found)
    if not found:
        ui.note("no device has answered; broadcasts do not pass routers: --broadcast ADDRESS queries one device")
    raise SystemExit(Exit.OK if found else Exit.JOB)


@command.command()
@with_device
@click.argument("seconds", type=FiniteRange(min=0.1), default=0.3)
@json_option
def status(device: Device, seconds: float, as_json: bool) -> None:
    """Show status reports for some seconds; the latest with --json. For an I/O module: its channels."""
    is_module = device.handshake().device_mode == MODULE_MODE
    report = None
    for report in device.reports(seconds):
        if not as_json and not is_module:
            ui.data.print(status_line(report))
    if report is None:
        return
    channels = read_channels(device, report) if is_module else []
    if as_json:
        more = {"channels": [asdict(channel) for channel in channels]} if is_module else {}
        flags = [bit.name.lower() for bit in StatusFlag if report.flags & bit and bit.name]
        state = {"state": State(report.state).name.lower(), "alarm": _alarm(report.alarm), "flags": flags}
        ui.emit_json({**asdict(report), **state, **more})
    elif is_module:
        ui.data.print(f"{State(report.state).name.lower()}  up {report.uptime_ms / 1000:.1f} s")
        _channel_table(channels)


def _channel_table(channels: list[Channel]) -> None:
    table = Table(
        "channel", "direction", "pin", "pull-up", "inverted", "state", box=None, pad_edge=False, padding=(0, 2, 0, 0)
    )
    for channel in channels:
        state = "left out: pin" if channel.fault else "on" if channel.on else "off"
        pull_up = "yes" if channel.pull_up and channel.direction == "input" else ""
        pin = "-" if channel.pin is None else str(channel.pin)
        table.add_row(str(channel.number), channel.direction, pin, pull_up, "yes" if channel.invert else "", state)
    ui.data.print(table)


@command.command()
@with_device
@click.argument("number", type=int)
@click.option("--input/--output", "is_input", default=None, help="Its direction.")
@click.option("--pin", type=click.IntRange(0, NO_PIN), help="Its pin; 255: none.")
@click.option("--pull-up/--no-pull-up", default=None, help="Of an input.")
@click.option("--invert/--no-invert", default=None, help="On while its pin is low.")
@json_option
def channel(
    device: Device,
    number: int,
    is_input: bool | None,
    pin: int | None,
    pull_up: bool | None,
    invert: bool | None,
    as_json: bool,
) -> None:
    """Show channel NUMBER of an I/O module, or change it. A change is stored and takes effect immediately."""
    check_number(number)
    output = None if is_input is None else not is_input
    change = Change(output, pin, pull_up, invert)
    if change != Change():
        configure(device, number, change)
    report = next(device.reports(1.0))
    found = [each for each in read_channels(device, report) if each.number == number]
    if not found:
        raise UserError(f"channel {number} is not in use", hint=f"wificnc wmc3 channel {number} --pin N configures it")
    if as_json:
        ui.emit_json(asdict(found[0]))
    else:
        _channel_table(found)


@command.command()
@with_device
@click.argument("number", type=int)
@click.argument("state", type=click.Choice(["on", "off"]))
@click.option("--hold", "seconds", type=FiniteRange(min=0), default=0.0, help="Stay connected for so many seconds.")
def output(device: Device, number: int, state: str, seconds: float) -> None:
    """Switch output NUMBER of an I/O module.

    When this command ends, the module loses its host: after io_link_timeout_ms the outputs go to their safe state,
    unless io_link_lost is 0. --hold keeps the connection.
    """
    switch(device, check_number(number), state == "on")
    time.sleep(seconds)


def status_line(report: Status) -> str:
    """One report on one line."""
    where = " ".join(f"{axis}{steps:+d}" for axis, steps in zip(AXES, report.position_steps, strict=True))
    alarm = f" ({_alarm(report.alarm)})" if report.alarm else ""
    return f"{State(report.state).name.lower()}{alarm} {where} free {report.buffer_free} {report.rate_steps_s} steps/s"


def _alarm(code: int) -> str:
    return f"limit_{AXES[code - 1].lower()}" if 1 <= code <= 6 else Alarm(code).name.lower()


@command.command()
@with_device
@json_option
def counters(device: Device, as_json: bool) -> None:
    """Show the counters of the device: lost and duplicate datagrams, refusals, underruns."""
    counts = asdict(device.request(Statistics(), StatisticsResponse))
    counts["owner"] = ".".join(map(str, counts["owner"]))
    counts["last_refusal"] = Refusal(counts["last_refusal"]).name.lower()
    if as_json:
        ui.emit_json(counts)
    else:
        _rows(counts)


@command.command()
@with_device
@click.argument("name", required=False)
@click.argument("value", required=False)
@click.option("--save", is_flag=True, help="Also store the value.")
@json_option
def config(device: Device, name: str | None, value: str | None, save: bool, as_json: bool) -> None:
    """Configuration keys: all of them, one of them, or set one: `config max_rate_mm_min.x 10000 --save`."""
    if name and value is not None:
        key, row = find_key(name)
        kind, data = pack_value(row, value)
        device.set(key, kind, data, f"{_key_name(key, row)} = {value}", value_hint(row))
        if save:
            device.save()
            if row.name in ON_TRIAL:
                ui.note("run `wificnc wmc3 config wifi_ssid` within two minutes, or the old values return")
    rows = [find_key(name)] if name else [(row.key + n, row) for row in KEYS for n in range(row.count)]
    values = {_key_name(key, row): device.get(key) for key, row in rows}
    if as_json:
        ui.emit_json(values)
    else:
        _rows({f"0x{key:04X} {_key_name(key, row)}": f"{values[_key_name(key, row)]} {row.unit}" for key, row in rows})


def _key_name(key: int, row: Key) -> str:
    if row.count == 1:
        return row.name
    return f"{row.name}.{'xyzabc'[key - row.key] if row.count == len(AXES) else key - row.key}"


def _axis(letter: str) -> int:
    if letter.upper() not in AXES or len(letter) != 1:
        raise UserError(f"{letter!r} is not an axis", hint="one of X Y Z A B C")
    return AXES.index(letter.upper())


@command.command()
@with_device
@click.argument("axis")
@click.argument("speed", type=int)
@click.argument("seconds", type=FiniteRange(0, 600))
def jog(device: Device, axis: str, speed: int, seconds: float) -> None:
    """Move an AXIS at SPEED steps/s (negative: the other direction: `-- X -500 2`) for some SECONDS."""
    if speed == 0:
        raise UserError("the speed of a jog must not be 0", hint="positive, or negative for the other direction")
    device.jog(Jog(_axis(axis), 1 if speed > 0 else -1, abs(speed)), seconds)


@command.command()
@with_device
@click.argument("axes", default=AXES)
def home(device: Device, axes: str) -> None:
    """Home AXES, like XY; axes without travel are skipped. Returns immediately: `status` shows the progress."""
    device.command(Home(sum({1 << _axis(letter) for letter in axes})))


def _simple(name: str, payload: Any, text: str) -> None:
    @command.command(name, help=text)
    @with_device
    def run(device: Device) -> None:
        device.command(payload())


_simple("estop", Estop, "Stop immediately; `reset` unlocks.")
_simple("hold", Hold, "Slow down along the path and stop.")
_simple("resume", Resume, "Resume after a hold.")
_simple("reset", Reset, "Leave alarm or e-stop; or release motion to the G-code side.")


@command.command()
@with_device
@click.option("--discard", is_flag=True, help="Discard the queued motion of the other host instead of holding it.")
@click.option("--hold", "seconds", type=FiniteRange(min=0), default=0.0, help="Stay connected for some seconds.")
def take(device: Device, discard: bool, seconds: float) -> None:
    """Take control from another host. Its jog ends and its motion is held: `resume` continues it.

    The other host is refused as long as this one is there: when this command ends, the first to send motion is in
    control again. --hold keeps the connection.
    """
    device.take(discard)
    time.sleep(seconds)


@command.command()
@with_device
@click.argument("moves", nargs=-1, required=True, metavar="AXIS=STEPS ...")
@click.option(
    "--speed",
    type=FiniteRange(min=1),
    default=1000.0,
    show_default=True,
    help="Steps/s of the fastest axis.",
)
@json_option
def motion(device: Device, moves: tuple[str, ...], speed: float, as_json: bool) -> None:
    """Move some axes by steps, as a stream: every step arrives. `motion X=1000 Y=-500`"""
    told = False

    def report_hold(sender: StreamSender) -> None:
        nonlocal told
        if sender.is_held and not told:
            ui.note("the machine is in a hold; this waits until `wificnc wmc3 resume`, or Ctrl-C gives up")
        told = sender.is_held

    sender = device.stream(slices(parse_moves(moves), speed), report_hold)
    result = {"segments": sender.end, "executed": sender.done, "underruns": sender.underruns, "datagrams": sender.sent}
    if as_json:
        ui.emit_json(result)
    else:
        ui.note(f"{sender.done} segments executed, {sender.underruns} underruns")


def parse_moves(moves: tuple[str, ...]) -> list[int]:
    """Steps of every axis from `X=1000 Y=-500`. Raises UserError."""
    steps: dict[int, int] = {}
    for move in moves:
        letter, _, count = move.partition("=")
        try:
            axis, number = _axis(letter), int(count)
        except ValueError:
            raise UserError(f"{move!r} is not a move", hint="like X=1000") from None
        if axis in steps:
            raise UserError(f"{letter.upper()} is given twice", hint="one move of each axis")
        if abs(number) > STEPS_MAX:
            raise UserError(f"{move} is too far", hint=f"a position has at most {STEPS_MAX} steps")
        steps[axis] = number
    return [steps.get(axis, 0) for axis in range(len(AXES))]


def slices(steps: list[int], speed: float) -> list[Segment]:
    """A straight move in slices of 10 ms, of a long one in longer ones; the device sees to ramps and limits."""
    most = max(abs(count) for count in steps)
    count = min(SLICES_MAX, max(1, round(most / speed / SLICE_S)))
    duration_us = max(1, round(most / speed / count * 1e6))
    places = [[round(axis * n / count) for axis in steps] for n in range(count + 1)]
    return [
        Segment(tuple(after - before for before, after in zip(one, two, strict=True)), duration_us)
        for one, two in pairwise(places)
    ]


@command.command()
@with_device
@click.option("--requests", type=click.IntRange(10, 100_000), default=1000, show_default=True)
@click.option("--seconds", type=FiniteRange(0.5, 3600), default=3.0, show_default=True, help="Of reports.")
@json_option
def bench(device: Device, requests: int, seconds: float, as_json: bool) -> None:
    """Measure the round trip of requests and the jitter of reports. Does not move the machine."""
    trips = measure_trips(device, requests)
    reports = measure_reports(device, seconds)
    result = {
        "round_trip_median_ms": round(trips.median_ms, 3),
        "round_trip_p99_ms": round(trips.p99_ms, 3),
        "status_interval_ms": reports.interval_ms,
        "status_mean_ms": round(reports.mean_ms, 3),
        "status_jitter_median_ms": round(reports.median_jitter_ms, 3),
        "status_jitter_p99_ms": round(reports.p99_jitter_ms, 3),
        "status_jitter_most_ms": round(reports.most_jitter_ms, 3),
        "method": method(trips, reports),
    }
    if as_json:
        ui.emit_json(result)
        return
    _rows({name: value for name, value in result.items() if name != "method"})
    ui.note(str(result["method"]))


def _rows(values: dict[str, Any]) -> None:
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for name, value in values.items():
        table.add_row(f"[dim]{name}[/]", str(value).strip())
    ui.data.print(table)
