"""Spindle drives (VFD) in configurations of FluidNC."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board.fluidnc.convert import Imported, import_fluidnc
from wificnc.board.fluidnc.remarks import Kind
from wificnc.board.fluidnc.vfd import MODELS
from wificnc.board.load import check_board
from wificnc.profile import load_machine
from wificnc.tables.vfd import load_vfds

HEAD = """board: Test
name: Test
stepping:
  engine: RMT
uart1:
  txd_pin: gpio.17
  rxd_pin: gpio.16
  rts_pin: gpio.4
  baud: 19200
  mode: 8E1
axes:
  x:
    steps_per_mm: 200
    max_rate_mm_per_min: 3000
    acceleration_mm_per_sec2: 200
    max_travel_mm: 300
    motor0:
      stepstick:
        step_pin: gpio.12
        direction_pin: gpio.14
"""
OWN = """ModbusVFD:
  uart_num: 1
  modbus_id: 3
  model: something
  min_RPM: 3000
  max_RPM: 24000
  cw_cmd: 06 20 00 00 12 > echo
  ccw_cmd: 06 20 00 00 22 > echo
  off_cmd: 06 20 00 00 01 > echo
  set_rpm_cmd: 06 20 01 rpm*10/60 > echo
  get_rpm_cmd: 03 20 0b 00 01 > 03 02 rpm*6
  speed_map: 0=0% 3000=0% 24000=100%
"""
# FluidNC's name -> $395, by the titles of docs/spindles.md
NAMES = {
    "Huanyang": 2, "H2A": 3, "H100": 4, "YL620": 5, "NowForever": 6, "FolinnBD600": 7, "SiemensV20": 8, "DeltaMS300": 9,
}  # fmt: skip


def converted(folder: Path, spindle: str, head: str = HEAD) -> Imported:
    path = folder / "config.yaml"
    path.write_text(head + spindle, encoding="utf-8")
    return import_fluidnc(path)


def settings(folder: Path, imported: Imported) -> dict[int, object]:
    """Of the machine profile; the board file breaks no rule."""
    board, profile = folder / "mine.toml", folder / "machine.toml"
    board.write_text(imported.board_text("config.yaml"), encoding="utf-8")
    assert check_board(board) == []
    profile.write_text(imported.machine_text("config.yaml"), encoding="utf-8")
    return dict(load_machine(profile).settings())


@pytest.mark.parametrize("name", NAMES)
def test_each_model_gets_its_number_bus_and_address(tmp_path: Path, name: str) -> None:
    imported = converted(
        tmp_path, f"{name}:\n  uart_num: 1\n  modbus_id: 7\n  tool_num: 0\n  speed_map: 0=0% 6000=25% 24000=100%\n"
    )
    assert not imported.refused
    assert imported.remarks.lines(Kind.LOST) == []
    assert imported.board["spindle_bus"] == {
        "uart": "UART1",
        "tx": {"pin": "GPIO17", "active": "high"},
        "rx": {"pin": "GPIO16", "active": "high", "pull": "none"},
        "de": {"pin": "GPIO4", "active": "high"},
    }
    found = settings(tmp_path, imported)
    assert [found[number] for number in (395, 460, 374, 681, 30)] == [NAMES[name], 7, 3, 1, 24000]
    assert 34 not in found and 35 not in found and 36 not in found, "a drive has no PWM"


def test_every_name_has_a_row_of_the_table() -> None:
    assert set(MODELS.values()) == {vfd.name for vfd in load_vfds().vfd}


def test_a_uart_inside_of_the_spindle_as_earlier_versions_had_it(tmp_path: Path) -> None:
    head = HEAD[: HEAD.index("uart1:")] + HEAD[HEAD.index("axes:") :]
    uart = "  uart:\n    txd_pin: gpio.17\n    rxd_pin: gpio.16\n    baud: 9600\n    mode: 8N1\n"
    imported = converted(tmp_path, f"H100:\n{uart}  modbus_id: 1\n", head)
    found = settings(tmp_path, imported)
    assert imported.board["spindle_bus"]["uart"] == "UART2"
    assert [found[number] for number in (395, 460, 374, 681)] == [4, 1, 2, 0]


def test_frames_of_a_register_each_become_settings(tmp_path: Path) -> None:
    imported = converted(tmp_path, OWN)
    assert imported.remarks.lines(Kind.LOST) == []
    found = settings(tmp_path, imported)
    assert [found[number] for number in range(462, 472)] == [
        0x2000, 0x2001, 0x200B, 0x12, 0x22, 0x01, 10.0, 60.0, 6.0, 1.0,
    ]  # fmt: skip
    assert [found[number] for number in (395, 460)] == [1, 3]


def test_a_drive_without_a_register_of_its_speed(tmp_path: Path) -> None:
    imported = converted(tmp_path, "".join(line for line in OWN.splitlines(True) if "get_rpm" not in line))
    assert settings(tmp_path, imported)[464] == 65535


@pytest.mark.parametrize(
    ("spindle", "why"),
    [
        ("DanfossVLT2800:\n  uart_num: 1\n", "no frames of this model are known here"),
        ("MollomG70:\n  uart_num: 1\n", "no frames of this model are known here"),
        ("Huanyang:\n  modbus_id: 1\n", "uart_num names no UART"),
        ("Huanyang:\n  uart_num: 2\n", "uart_num names no UART"),
        (OWN.replace("06 20 00 00 22", "06 20 02 00 22"), "more than a register for each command"),
        (OWN.replace("06 20 01 rpm", "10 20 01 00 01 02 rpm"), "more than a register for each command"),
        (OWN.replace("03 02 rpm*6", "03 04 00 00 rpm*6"), "more than a register for each command"),
    ],
)
def test_what_has_no_counterpart_is_said(tmp_path: Path, spindle: str, why: str) -> None:
    imported = converted(tmp_path, spindle)
    (line,) = [line for line in imported.remarks.lines(Kind.LOST) if "a frequency inverter on RS-485" in line]
    assert why in line
    assert "spindle_bus" not in imported.board and "type" not in imported.machine.get("spindle", {})


def test_a_format_that_is_not_here_is_a_change(tmp_path: Path) -> None:
    head = HEAD.replace("19200", "57600").replace("8E1", "7E2")
    imported = converted(tmp_path, "Huanyang:\n  uart_num: 1\n", head)
    lines = "\n".join(imported.remarks.lines(Kind.CHANGED))
    assert "57600" in lines and "7e2" in lines.lower()
    assert 374 not in settings(tmp_path, imported)


def test_a_second_spindle_is_lost(tmp_path: Path) -> None:
    imported = converted(tmp_path, "Huanyang:\n  uart_num: 1\nLaser:\n  output_pin: gpio.25\n")
    assert any(line.startswith("laser ") and "second spindle" in line for line in imported.remarks.lines(Kind.LOST))


def test_without_a_speed_map_the_range_of_the_drive_is_that_of_the_configuration(tmp_path: Path) -> None:
    imported = converted(tmp_path, OWN[: OWN.index("  speed_map")])
    assert (imported.machine["spindle"]["max_rpm"], imported.machine["spindle"]["min_rpm"]) == (24000, 3000)
    assert "$30" not in "\n".join(imported.remarks.lines(Kind.CHANGED))


@pytest.mark.parametrize("spindle", ["H2A:\n  uart_num: 1\n", "H2A:\n  uart_num: 1\n  max_RPM: 4294967295\n"])
def test_a_speed_that_fluidnc_reads_from_the_drive_is_to_be_set(tmp_path: Path, spindle: str) -> None:
    """$30 would stay at 1000 rpm, and each S above would be that."""
    imported = converted(tmp_path, spindle)
    assert "max_rpm" not in imported.machine["spindle"]
    assert "set $30" in "\n".join(imported.remarks.lines(Kind.CHANGED))
