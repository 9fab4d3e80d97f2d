"""`wificnc doctor`, and backtraces in `wificnc monitor`."""

from __future__ import annotations

import importlib.metadata
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from patience import HANG_S
from wificnc import doctor
from wificnc.connection.backtrace import Decoder, addresses, find_tool
from wificnc.errors import BuildError, UserError
from wificnc.firmware.flash.ports import Port
from wificnc.system import System, read_os_release

PYTHON = "/opt/python"
PIP = f"{PYTHON} -m pip install "
ONE = Port("/dev/ttyACM0", "Espressif: USB JTAG")


# computer -> its platform, os-release, and how a command that installs something there may begin
COMPUTERS = {
    "Debian": ("linux", {"ID": "debian"}, ("sudo apt-get install ", PIP)),
    "Ubuntu": ("linux", {"ID": "ubuntu", "ID_LIKE": "debian"}, ("sudo apt-get install ", PIP)),
    "Mint": ("linux", {"ID": "linuxmint", "ID_LIKE": "ubuntu debian"}, ("sudo apt-get install ", PIP)),
    "Raspberry Pi OS": ("linux", {"ID": "raspbian", "ID_LIKE": "debian"}, ("sudo apt-get install ", PIP)),
    "Fedora": ("linux", {"ID": "fedora"}, ("sudo dnf install ", PIP)),
    "Rocky": ("linux", {"ID": "rocky", "ID_LIKE": "rhel centos fedora"}, ("sudo dnf install ", PIP)),
    "Arch": ("linux", {"ID": "arch"}, ("sudo pacman -S ", PIP)),
    "openSUSE": ("linux", {"ID": "opensuse-tumbleweed", "ID_LIKE": "opensuse suse"}, ("sudo zypper install ", PIP)),
    "another Linux": ("linux", {}, (PIP,)),
    "macOS": ("darwin", {}, ("brew install ", "xcode-select --install", PIP)),
    "Windows": ("win32", {}, ("winget install --exact --id ", f'& "{PYTHON}" -m pip install ')),
}


def nothing() -> str:
    raise BuildError("it is not here", hint="a hint for another system")


def no_package(name: str) -> str:
    raise importlib.metadata.PackageNotFoundError(name)


def bare(computer: str, **more: Any) -> doctor.Doctor:
    """That computer with nothing on it but an old Python, in a checkout, and a board that it may not use."""
    platform, os_release, _ = COMPUTERS[computer]
    look = doctor.Look(
        python=(3, 9, 1), checkout=lambda: Path("/repo"), library=lambda: None, compiler=nothing,
        pic32mz_compiler=nothing, platformio=nothing, version=no_package, ports=lambda: [ONE],
        may_use=lambda device: False,
    )  # fmt: skip
    return doctor.Doctor(System(platform, os_release, PYTHON, lambda name: None), replace(look, **more))


def test_every_finding_that_is_not_good_says_how_to_mend_it() -> None:
    for finding in doctor.Doctor().examine():
        assert finding.name and finding.found
        assert finding.verdict == "good" or finding.fix, finding


@pytest.mark.parametrize("computer", COMPUTERS)
def test_each_missing_thing_has_the_command_of_its_system(computer: str) -> None:
    findings = {finding.name: finding for finding in bare(computer).examine()}
    assert {name for name, finding in findings.items() if finding.verdict == "good"} == {"sources"}
    for name in set(findings) - {"sources", "board"}:
        if computer == "another Linux" and name in ("Python", "Node.js"):
            assert findings[name].fix  # what to install; by which command is not known
            continue
        begins = next((each for each in COMPUTERS[computer][2] if findings[name].fix.startswith(each)), None)
        assert begins, findings[name]
        assert findings[name].needed_for and (findings[name].fix > begins or begins == "xcode-select --install")


@pytest.mark.parametrize(("computer", "fix"), [
    ("Debian", "sudo adduser $USER dialout, "), ("Arch", "sudo adduser $USER uucp, "), ("macOS", "close "),
    ("Windows", "close "),
])  # fmt: skip
def test_a_port_that_may_not_be_used_is_wrong(computer: str, fix: str) -> None:
    (locked,) = bare(computer).serial_ports()
    assert locked.verdict == "wrong" and locked.fix.startswith(fix)


def test_the_group_is_joined_by_the_tool_that_is_here() -> None:
    system = System("linux", {"ID": "fedora"}, PYTHON, lambda name: f"/usr/sbin/{name}" if name == "usermod" else None)
    assert system.join_serial_group() == "sudo usermod -aG dialout $USER"


@pytest.mark.parametrize("computer", COMPUTERS)
def test_ports(computer: str) -> None:
    (fine,) = bare(computer, may_use=lambda device: True).serial_ports()
    assert fine.verdict == "good" and ONE.device in fine.found
    (none,) = bare(computer, ports=list).serial_ports()
    assert none.verdict == "missing" and none.fix


@pytest.mark.parametrize("computer", ["Debian", "macOS", "Windows"])
def test_a_package_with_its_library_needs_no_compiler_and_no_node(computer: str) -> None:
    package = bare(computer, checkout=lambda: None, library=lambda: Path("lib/libwificnc.so"))
    (compiler,) = package.compiler()
    assert compiler.verdict == "good" and "libwificnc.so" in compiler.found
    assert list(package.node()) == []


def test_in_a_checkout_the_library_of_a_package_does_not_count() -> None:
    (compiler,) = bare("Debian", library=lambda: Path("lib/libwificnc.so")).compiler()
    assert compiler.verdict == "missing"


def test_platformio_without_its_downloads() -> None:
    (found,) = bare("Debian", platformio=lambda: "pio", downloads=lambda: ["tool-cmake"]).platformio()
    assert found.verdict == "missing" and "tool-cmake" in found.found and found.fix


def test_os_release_is_read(tmp_path: Path) -> None:
    file = tmp_path / "os-release"
    file.write_text('NAME="Debian GNU/Linux"\nID=debian\nID_LIKE="a b"\n')
    assert read_os_release(file) == {"NAME": "Debian GNU/Linux", "ID": "debian", "ID_LIKE": "a b"}
    assert read_os_release(tmp_path / "none") == {}


@pytest.mark.parametrize(("platform", "command"), [
    ("linux", "'/opt/a b/python' -m pip install x"), ("win32", '& "/opt/a b/python" -m pip install x'),
])  # fmt: skip
def test_a_path_with_a_space_can_be_pasted(platform: str, command: str) -> None:
    assert System(platform, {}, "/opt/a b/python").pip("x") == command


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
