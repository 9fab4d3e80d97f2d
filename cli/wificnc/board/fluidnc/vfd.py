"""Spindle drives (VFD) on RS-485 of a configuration: [spindle_bus] of the board file, and what the machine profile has
of the drive."""

from __future__ import annotations

import re
from typing import Any

from wificnc.board.fluidnc.pins import SHIFTED, take_pin
from wificnc.board.fluidnc.remarks import Remarks
from wificnc.board.fluidnc.tree import Section
from wificnc.tables.vfd import load_vfds

# FluidNC's name, in small letters and perhaps with the model behind it -> name in protocol/vfd.toml.
MODELS = {
    "huanyang": "huanyang_v1",
    "h2a": "h2a",
    "h100": "h100",
    "yl620": "yl620",
    "nowforever": "nowforever",
    "folinn": "bd600",
    "siemensv20": "siemens_v20",
    "deltams": "delta_ms300",
    "modbusvfd": "own",
}
# Those of which no frames are in our table.
UNKNOWN = ("danfoss", "mollom", "fulling")
INVERTER = "a frequency inverter on RS-485"
_BAUDS = (2400, 4800, 9600, 19200, 38400, 115200)  # $374
_PARITIES = {"N": 0, "E": 1, "O": 2}  # $681
_RUN = re.compile(r"06 (?P<register>[0-9a-f]{2} ?[0-9a-f]{2}) (?P<command>[0-9a-f]{2} ?[0-9a-f]{2}) ?> ?echo")
_SET = re.compile(r"06 (?P<register>[0-9a-f]{2} ?[0-9a-f]{2}) rpm(?P<scale>[*/.0-9]*) ?> ?echo")
_GET = re.compile(r"03 (?P<register>[0-9a-f]{2} ?[0-9a-f]{2}) 00 ?01 ?> ?03 02 rpm(?P<scale>[*/.0-9]*)")
_SCALE = re.compile(r"(?:\*(?P<times>\d+(?:\.\d+)?))?(?:/(?P<by>\d+(?:\.\d+)?))?")
_UNSET_RPM = 0xFFFFFFFF  # as a configuration that FluidNC has written has it
_NO_READING = 65535  # $464: it has no register of its speed


def model_of(kind: str) -> str | None:
    """The row of protocol/vfd.toml; None: it has none."""
    return next((row for name, row in MODELS.items() if kind.startswith(name)), None)


def read_vfd(kind: str, section: Section, root: Section, remarks: Remarks) -> tuple[dict[str, Any], dict[str, Any]]:
    """[spindle_bus], and keys of [spindle] of the machine profile; both empty: not taken, which is a remark."""
    name, bus = model_of(kind), _bus(section, root, remarks)
    own = _own(section) if name == "own" else {}
    address = section.whole("modbus_id") or 1
    why = ""
    if name is None:
        why = "no frames of this model are known here (docs/spindles.md)"
    elif not bus:
        why = "uart_num names no UART with txd_pin and rxd_pin at pins of the chip"
    elif own is None:
        why = "its frames are more than a register for each command ($462 to $471)"
    if why:
        remarks.lost(section.path, section.line, f"{INVERTER}: {why}: not taken")
        return {}, {}
    number = next(vfd.number for vfd in load_vfds().vfd if vfd.name == name)
    profile = {"type": number, "vfd_address": address, **_format(section, root, remarks), **(own or {})}
    _uart(section, root).skip_all()
    return bus, profile


def read_range(section: Section, remarks: Remarks) -> dict[str, Any]:
    """$30 and $31 of a configuration without speed_map."""
    found = {key: section.whole(key) for key in ("max_rpm", "min_rpm")}
    if found["max_rpm"] in (0, _UNSET_RPM):
        why = "FluidNC reads the highest speed from the drive: set $30 (max_rpm in [spindle]), here 1000 rpm until then"
        remarks.changed(section.path, section.line, why)
    return {key: rpm for key, rpm in found.items() if rpm not in (0, _UNSET_RPM)}


def _uart(section: Section, root: Section) -> Section:
    """Its own in earlier versions of FluidNC."""
    if "uart" in section.sections:
        return section.section("uart")
    number = section.whole("uart_num")
    return root.section(f"uart{number}") if number > 0 else Section("", 0)


def _bus(section: Section, root: Section, remarks: Remarks) -> dict[str, Any]:
    uart = _uart(section, root)
    if not {"txd_pin", "rxd_pin"} <= uart.values.keys():
        return {}
    pins = {key: take_pin(uart, f"{name}_pin", remarks) for key, name in (("tx", "txd"), ("rx", "rxd"), ("de", "rts"))}
    found = {key: pin for key, pin in pins.items() if pin}
    if not {"tx", "rx"} <= found.keys() or any(pin.name.startswith(SHIFTED) for pin in found.values()):
        return {}
    number = section.whole("uart_num") or 2
    return {
        "uart": f"UART{number}",
        **{key: pin.input() if key == "rx" else pin.output() for key, pin in found.items()},
    }


def _format(section: Section, root: Section, remarks: Remarks) -> dict[str, Any]:
    """Baud rate and parity, where the configuration has them."""
    uart, made = _uart(section, root), dict[str, Any]()
    baud, mode = uart.whole("baud"), uart.take("mode")
    if baud in _BAUDS:
        made["vfd_baud"] = _BAUDS.index(baud)
    elif baud:
        remarks.changed(
            f"{uart.path}.baud", uart.line_of("baud"), f"{baud}; $374 is one of {', '.join(map(str, _BAUDS))}"
        )
    if mode and re.fullmatch(r"8[NEO]1", mode.upper()):
        made["vfd_parity"] = _PARITIES[mode.upper()[1]]
    elif mode:
        remarks.changed(
            f"{uart.path}.mode", uart.line_of("mode"), f"{mode}; a character has 8 bits and 1 stop bit here"
        )
    return made


def _own(section: Section) -> dict[str, Any] | None:
    """Frames as settings; None: they are of another form."""
    texts = {key: _plain(section.take(f"{key}_cmd")) for key in ("cw", "ccw", "off", "set_rpm", "get_rpm")}
    section.skip("get_min_rpm_cmd", "get_max_rpm_cmd", "model")
    runs = [_RUN.fullmatch(texts[key]) for key in ("cw", "ccw", "off")]
    speed, reading = _SET.fullmatch(texts["set_rpm"]), _GET.fullmatch(texts["get_rpm"])
    if not all(runs) or not speed or (texts["get_rpm"] and not reading):
        return None
    scales = [_SCALE.fullmatch(match["scale"]) if match else None for match in (speed, reading)]
    registers = {_hex(run["register"]) for run in runs if run}
    if len(registers) != 1 or scales[0] is None or (reading and scales[1] is None):
        return None
    commands = [_hex(run["command"]) for run in runs if run]
    made: dict[str, Any] = {
        "vfd_run_register": registers.pop(),
        "vfd_set_register": _hex(speed["register"]),
        "vfd_read_register": _hex(reading["register"]) if reading else _NO_READING,
        **dict(zip(("vfd_clockwise", "vfd_counter_clockwise", "vfd_stop"), commands, strict=True)),
    }
    for name, scale in zip(("set", "read"), scales, strict=True):
        if scale is not None:
            made[f"vfd_{name}_multiplier"] = float(scale["times"] or 1)
            made[f"vfd_{name}_divider"] = float(scale["by"] or 1)
    return made


def _plain(text: str | None) -> str:
    return " ".join((text or "").lower().split())


def _hex(text: str) -> int:
    return int(text.replace(" ", ""), 16)
