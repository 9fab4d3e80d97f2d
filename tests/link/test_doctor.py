"""`wificnc doctor`, and backtraces in `wificnc monitor`."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from patience import HANG_S
from wificnc import doctor
from wificnc.errors import UserError
from wificnc.flash.ports import Port
from wificnc.link.backtrace import Decoder, addresses, find_tool

ONE = Port("/dev/ttyACM0", "Espressif: USB JTAG")


def test_every_finding_that_is_not_good_says_how_to_mend_it() -> None:
    for finding in doctor.examine():
        assert finding.name and finding.found
        assert finding.verdict == "good" or finding.fix, finding


def test_an_old_python_is_wrong() -> None:
    (finding,) = doctor.python((3, 9, 1))
    assert finding.verdict == "wrong" and "3.10" in finding.fix


def test_a_port_without_rights_is_wrong_and_no_port_is_only_missing() -> None:
    (locked,) = doctor.serial_ports(lambda: [ONE], lambda device: False)
    assert (locked.verdict == "wrong" and "usermod" in locked.fix) or "adduser" in locked.fix
    (fine,) = doctor.serial_ports(lambda: [ONE], lambda device: True)
    assert fine.verdict == "good" and ONE.device in fine.found
    (none,) = doctor.serial_ports(list)
    assert none.verdict == "missing"


def test_the_command_prints_json_for_scripts() -> None:
    command = [sys.executable, "-m", "wificnc", "doctor", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, check=False)
    names = {row["name"] for row in json.loads(run.stdout)}
    assert {"Python", "C compiler", "PlatformIO", "esptool", "board"} <= names


def test_only_backtraces_have_addresses() -> None:
    line = "Backtrace: 0x400d1234:0x3ffb1f90 0x400D5678:0x3ffb1fb0\r\n"
    assert addresses(line) == [0x400D1234, 0x400D5678]
    assert addresses("ok") == [] and addresses("[MSG:Backtrace: 0x1:0x2]") == []


def test_addresses_become_places_in_the_sources(tmp_path: Path) -> None:
    tool = shutil.which("addr2line")
    if tool is None or shutil.which("gcc") is None or shutil.which("nm") is None:
        pytest.skip("binutils and gcc are not here")
    source = tmp_path / "crash.c"
    source.write_text("int deep(int n) {\n    return n + 1;\n}\nint main(void) {\n    return deep(1);\n}\n")
    elf = tmp_path / "crash.elf"
    subprocess.run(["gcc", "-g", "-O0", "-no-pie", str(source), "-o", str(elf)], check=True)
    symbols = subprocess.run(["nm", str(elf)], capture_output=True, text=True, check=True).stdout
    deep, main = (int(re.search(rf"^(\w+) T {name}$", symbols, re.M)[1], 16) for name in ("deep", "main"))  # type: ignore[index]
    said = Decoder(elf, tool).decode(f"Backtrace: 0x{deep:08x}:0x3ffb1f90 0x{main + 5:08x}:0x3ffb1fb0")
    assert "deep at" in said[0] and "crash.c:1" in said[0] and "main at" in said[1]
    assert Decoder(elf, tool).decode("ok") == []


def test_without_a_tool_that_reads_them_it_is_said() -> None:
    with pytest.raises(UserError, match="addr2line"):
        Decoder(Path("x.elf"), None)


def test_platformios_own_tool_comes_first(tmp_path: Path) -> None:
    tool = tmp_path / "toolchain-xtensa-esp-elf" / "bin" / "xtensa-esp32s3-elf-addr2line"
    tool.parent.mkdir(parents=True)
    tool.touch()
    assert find_tool(tmp_path) == str(tool)
