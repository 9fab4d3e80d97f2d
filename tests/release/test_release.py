"""The release as a whole: what is in it, that its parts belong together, that the same commit gives the same bytes."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from release_tree import ESP32_BOARDS, PAGE, PIC32MZ_BOARD, Tree, build_boards, make_tree
from wificnc import __version__
from wificnc.board.load import load_board
from wificnc.connection.wmc3.layout import Jog
from wificnc.connection.wmc3.packet import build

pytestmark = pytest.mark.slow  # test_release_refused makes releases, too
SETTINGS_AT, SETTINGS_SIZE = 0x9000, 0x6000  # nvs of targets/esp32/partitions.csv
# Where each chip's ROM looks for the bootloader (ESP-IDF, "Bootloader"); the rest as in partitions.csv.
OFFSETS = {
    board: {"bootloader": at, "partition-table": 0x8000, "slot-choice": 0xF000, "firmware": 0x20000}
    for board, at in (("esp32s3-zero", 0x0), ("esp32-wroom32", 0x1000))
}
CHIP_FAMILIES = {"esp32s3-zero": "ESP32-S3", "esp32-wroom32": "ESP32"}
UF2_FAMILIES = {"esp32s3-zero": 0xC47E5767, "esp32-wroom32": 0x1C5F21B0}  # github.com/microsoft/uf2, uf2families.json


CHIPS = f"wificnc_chips-{__version__}-py3-none-any.whl"


def asset(dist: Path, suffix: str) -> Path:
    return dist / f"wificnc-{__version__}{suffix}"


def load(path: Path) -> dict:  # type: ignore[type-arg]
    return json.loads(path.read_text())


def test_every_file_is_listed_and_sums_are_right(dist: Path, tree: Tree) -> None:
    files = {path.name for path in dist.iterdir() if path.is_file()}
    sums = dict(reversed(line.split("  ")) for line in (dist / "SHA256SUMS").read_text().splitlines())
    assert set(sums) == files - {"SHA256SUMS"}
    assert {name: hashlib.sha256((dist / name).read_bytes()).hexdigest() for name in sums} == sums
    record = load(dist / "release.json")
    assert {row["name"]: row["sha256"] for row in record["files"]} == {
        name: sums[name] for name in files - {"SHA256SUMS", "release.json"}
    }
    assert record["revision"] == tree.revision and record["version"] == __version__
    assert record["date"] == "2026-11-01T12:00:00Z"


def test_boards_that_need_the_workflow_are_named(dist: Path, tree: Tree) -> None:
    boards = load(dist / "release.json")["boards"]
    assert [name for name, row in boards.items() if row["state"] == "built"] == sorted(tree.boards)
    assert "workflow" in boards["esp32s3-devkitc"]["why"]
    assert "esp32s3-devkitc: " in (dist / "RELEASE_NOTES.md").read_text()
    said = tree.release("-o", "dist", "--dry-run").stderr
    assert "no firmware of esp32s3-devkitc: its compiler comes from Espressif's download servers" in said


@pytest.mark.parametrize("board", ESP32_BOARDS)
def test_the_merged_image_is_the_parts_at_their_offsets(dist: Path, board: str) -> None:
    merged = asset(dist, f"-{board}-merged.bin").read_bytes()
    blank = bytearray(b"\xff" * len(merged))
    for part, offset in OFFSETS[board].items():
        data = asset(dist, f"-{board}-{part}.bin").read_bytes()
        assert merged[offset : offset + len(data)] == data, part
        blank[offset : offset + len(data)] = data
    assert merged == bytes(blank)
    assert asset(dist, f"-{board}.elf").read_bytes()[:4] == b"\x7fELF"


@pytest.mark.parametrize("board", ESP32_BOARDS)
def test_the_manifest_is_what_esp_web_tools_wants(dist: Path, board: str) -> None:
    folder = dist / "web" / "firmware" / board
    manifest = load(folder / "manifest.json")
    assert manifest["version"] == __version__ and manifest["new_install_prompt_erase"] is True
    assert manifest["new_install_improv_wait_time"] == 0  # these images do not speak Improv
    (build,) = manifest["builds"]
    assert build["chipFamily"] == CHIP_FAMILIES[board]
    assert {part["path"]: part["offset"] for part in build["parts"]} == {
        f"{name}.bin": offset for name, offset in OFFSETS[board].items()
    }
    for part in build["parts"]:
        data = (folder / part["path"]).read_bytes()
        assert data == asset(dist, f"-{board}-{part['path']}").read_bytes()
        settings = range(SETTINGS_AT, SETTINGS_AT + SETTINGS_SIZE)
        assert part["offset"] + len(data) <= settings.start or part["offset"] >= settings.stop, "settings stay"


@pytest.mark.parametrize("board", ESP32_BOARDS)
def test_the_uf2_holds_the_parts_and_not_the_settings(dist: Path, board: str) -> None:
    """Microsoft's format: blocks of 512 bytes."""
    data = asset(dist, f"-{board}.uf2").read_bytes()
    flash: dict[int, bytes] = {}
    for at in range(0, len(data), 512):
        first, second, flags, address, size, number, count, family = struct.unpack_from("<8I", data, at)
        (last,) = struct.unpack_from("<I", data, at + 508)
        assert (first, second, last) == (0x0A324655, 0x9E5D5157, 0x0AB16F30)
        assert flags & 0x2000 and family == UF2_FAMILIES[board] and number < count
        flash[address] = data[at + 32 : at + 32 + size]
    for part, offset in OFFSETS[board].items():
        wanted = asset(dist, f"-{board}-{part}.bin").read_bytes()
        found = b"".join(flash[address] for address in sorted(flash) if offset <= address < offset + len(wanted))
        assert found[: len(wanted)] == wanted, part
    assert not any(SETTINGS_AT <= address < SETTINGS_AT + SETTINGS_SIZE for address in flash)


def test_the_index_offers_what_is_there(dist: Path, tree: Tree) -> None:
    folder = dist / "web" / "firmware"
    index = load(folder / "index.json")
    assert (index["version"], index["revision"]) == (__version__, tree.revision)
    rows = {row["id"]: row for row in index["boards"]}
    assert rows.keys() == {
        board.id for board in map(load_board, tree.root.glob("boards/*.toml")) if board.target != "host"
    }
    for name, row in rows.items():
        assert bool(row["missing"]) == (name not in tree.boards)
        assert [build["path"] for build in row["manifests"]] == [f"{name}/manifest.json"] * (name in ESP32_BOARDS)
        for file in row["files"]:
            data = (folder / file["path"]).read_bytes()
            assert (file["size"], file["sha256"]) == (len(data), hashlib.sha256(data).hexdigest())
    assert rows["esp32s3-zero"]["manifests"][0]["flash_mb"] == 4
    listed = {file["path"] for row in rows.values() for file in row["files"]}
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert listed == there - {"index.json"}


def test_the_archive_of_the_page_is_the_page(dist: Path) -> None:
    with tarfile.open(asset(dist, "-web.tar.gz")) as archive:
        packed = {row.name: archive.extractfile(row).read() for row in archive}  # type: ignore[union-attr]
    assert {f"web/{name}": text.encode() for name, text in PAGE.items()}.items() <= packed.items()
    files = {f"web/{p.relative_to(dist / 'web').as_posix()}": p for p in (dist / "web").rglob("*") if p.is_file()}
    assert packed == {name: path.read_bytes() for name, path in files.items()}
    assert list(packed) == sorted(packed)


def test_the_pic32mz_has_hex_and_elf(dist: Path, tree: Tree) -> None:
    if PIC32MZ_BOARD not in tree.boards:
        pytest.skip("gcc-mipsel-linux-gnu is not installed")
    from wificnc.build.image import Block, read_elf, read_hex

    def bytes_at(blocks: tuple[Block, ...]) -> dict[int, int]:
        return {block.address + n: byte for block in blocks for n, byte in enumerate(block.data)}

    image = asset(dist, f"-{PIC32MZ_BOARD}.hex").read_text()
    assert bytes_at(read_hex(image)) == bytes_at(read_elf(asset(dist, f"-{PIC32MZ_BOARD}.elf").read_bytes()))


def test_the_package_carries_firmware_that_flash_takes(dist: Path, tree: Tree) -> None:
    with zipfile.ZipFile(asset(dist, "-py3-none-any.whl")) as wheel, tarfile.open(asset(dist, ".tar.gz")) as sdist:
        in_wheel, in_sdist = set(wheel.namelist()), set(sdist.getnames())
        for board in ESP32_BOARDS:
            record = json.loads(wheel.read(f"wificnc/carried/firmware/{board}/build.json"))
            assert record["board"] == board and record["revision"] == tree.revision
            for row in record["artefacts"]:
                data = wheel.read(f"wificnc/carried/firmware/{board}/{row['name']}")
                assert hashlib.sha256(data).hexdigest() == row["sha256"]
                assert f"wificnc-{__version__}/firmware/{board}/{row['name']}" in in_sdist
    assert {f"wificnc/page/{name}" for name in PAGE} <= in_wheel
    assert {"wificnc/carried/core/config.h", "wificnc/carried/boards/esp32s3-zero.toml"} <= in_wheel
    assert not any("test" in Path(name).parts for name in in_wheel if "/core/" in name)


def test_the_package_index_takes_the_package(dist: Path) -> None:
    """Metadata, and a description that it can show: PyPI's own checks, where a warning counts, too."""
    names = ("wificnc", "wificnc_chips")
    packages = [dist / f"{name}-{__version__}{suffix}" for name in names for suffix in ("-py3-none-any.whl", ".tar.gz")]
    command = [sys.executable, "-m", "twine", "--no-color", "check", "--strict", *map(str, packages)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0 and run.stdout.count("PASSED") == len(packages), run.stdout + run.stderr


def test_the_description_leads_somewhere(dist: Path) -> None:
    """On PyPI there is no repository around it: its pictures and links are whole addresses, or it has none."""
    with zipfile.ZipFile(asset(dist, "-py3-none-any.whl")) as wheel:
        text = wheel.read(f"wificnc-{__version__}.dist-info/METADATA").decode()
    headers, _, description = text.partition("\n\n")
    assert {"Description-Content-Type: text/markdown", "License-Expression: MIT"} <= set(headers.splitlines())
    links = re.findall(r"\]\(([^)]+)\)", description)
    assert "pip install" in description and [link for link in links if not link.startswith("https://")] == []


def test_the_virtual_chips_are_another_package(dist: Path) -> None:
    """Of the same version, which it requires; neither has files of the other one, and no tests."""
    with zipfile.ZipFile(asset(dist, "-py3-none-any.whl")) as command, zipfile.ZipFile(dist / CHIPS) as other:
        in_command, in_other = command.namelist(), other.namelist()
        required = other.read(f"wificnc_chips-{__version__}.dist-info/METADATA").decode().splitlines()
        extras = command.read(f"wificnc-{__version__}.dist-info/METADATA").decode().splitlines()
    assert not [name for name in in_command if re.search("espsim|mzsim|wificnc_chips", name)]
    assert f"Version: {__version__}" in required
    assert [line for line in required if line.startswith("Requires-Dist")] == [f"Requires-Dist: wificnc=={__version__}"]
    assert "Requires-Dist: wificnc-chips; extra == 'chips'" in extras
    assert {"wificnc_chips/espsim/rom.def", "wificnc_chips/mzsim/cpu.c", "wificnc_chips/job.py"} <= {*in_other}
    assert {name.partition("/")[0] for name in in_other} == {"wificnc_chips", f"wificnc_chips-{__version__}.dist-info"}


@pytest.mark.parametrize("package", ["wificnc", "wificnc_chips"])
def test_the_source_distribution_builds_the_same_package(dist: Path, tmp_path: Path, package: str) -> None:
    """With firmware and page in it, though no git is there to ask."""
    with tarfile.open(dist / f"{package}-{__version__}.tar.gz") as sdist:
        sdist.extractall(tmp_path, filter="data")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1793534400"}  # COMMITTED
    folder = tmp_path / f"{package}-{__version__}"
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    wheel = f"{package}-{__version__}-py3-none-any.whl"
    assert (tmp_path / wheel).read_bytes() == (dist / wheel).read_bytes()


def test_the_bill_of_materials_is_spdx(dist: Path) -> None:
    from spdx_tools.spdx.parser.parse_anything import parse_file
    from spdx_tools.spdx.validation.document_validator import validate_full_spdx_document

    document = parse_file(str(asset(dist, ".spdx.json")))
    assert validate_full_spdx_document(document) == []
    assert document.creation_info.spdx_version == "SPDX-2.3"
    names = {package.name: package for package in document.packages}
    sums = dict(reversed(line.split("  ")) for line in (dist / "SHA256SUMS").read_text().splitlines())
    own = {name for name in sums if name.startswith("wificnc-") and not name.endswith(".spdx.json")}
    assert own <= set(names)
    assert all(names[name].checksums[0].value == sums[name] for name in own)
    assert {"pydantic", "esptool", "espressif32", "preact"} <= set(names)
    assert "vitest" not in names  # only tests it


def test_the_protocol_header_is_all_that_a_host_in_c_needs(dist: Path, tmp_path: Path) -> None:
    source = tmp_path / "host.c"
    source.write_text(
        "#define WIFICNC_PROTOCOL_IMPLEMENTATION\n"
        f'#include "{asset(dist, "-protocol.h")}"\n'
        f'#include "{asset(dist, "-protocol.h")}"\n'
        "#include <stdio.h>\n"
        "int main(void) {\n"
        "    uint8_t packet[WIRE_PACKET_MAX];\n"
        "    struct wire_jog jog = {.axis = 2, .direction = -1, .speed_steps_s = 70000};\n"
        "    wire_put_jog(packet + WIRE_HEADER_SIZE, &jog);\n"
        "    size_t size = wire_close(packet, WIRE_JOG, WIRE_JOG_SIZE, 7, 1234);\n"
        "    return fwrite(packet, 1, size, stdout) != size;\n"
        "}\n"
    )
    from wificnc.build.compiler import locate_compiler

    program = tmp_path / "host"
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-o", str(program)]
    subprocess.run([*locate_compiler(), *flags, str(source)], check=True)
    said = subprocess.run([str(program)], capture_output=True, check=True).stdout
    assert said == build(Jog(axis=2, direction=-1, speed_steps_s=70000), sequence=7, timestamp_us=1234)


def test_the_linuxcnc_component_is_one_c_file(dist: Path, tmp_path: Path) -> None:
    """It needs no other file of ours: halcompile builds it in an empty folder."""
    with tarfile.open(asset(dist, "-linuxcnc.tar.gz")) as archive:
        archive.extractall(tmp_path, filter="data")
    folder = tmp_path / f"wificnc-linuxcnc-{__version__}"
    assert {path.name for path in folder.iterdir()} == {"LICENSE", "README.md", "configs", "docs", "wificnc-hal.c"}
    assert not list(folder.rglob("*.py")) and '#include "' not in (folder / "wificnc-hal.c").read_text()
    assert (
        "sudo halcompile --install --userspace --extra-link-args=-lm wificnc-hal.c"
        in (folder / "README.md").read_text()
    )
    hal = (folder / "configs" / "shapeoko3" / "shapeoko3.hal").read_text()
    assert "loadusr -Wn wificnc wificnc-hal --address" in hal
    if not shutil.which("halcompile"):
        pytest.skip("LinuxCNC's halcompile is not here: apt-get install linuxcnc-uspace-dev")
    argv = ["halcompile", "--compile", "--userspace", "--extra-link-args=-lm", str(folder / "wificnc-hal.c")]
    built = subprocess.run(argv, capture_output=True, text=True, check=False)
    assert built.returncode == 0 and os.access(folder / "wificnc-hal", os.X_OK), built.stderr


@pytest.mark.deep
def test_the_same_commit_gives_the_same_bytes(tmp_path: Path) -> None:
    """Another folder, other file times, another umask, called from elsewhere; each tree compiles all of it."""
    one, other = (make_tree(tmp_path / folder) for folder in ("one", "somewhere/quite/else"))
    for path in (other.root / "core").rglob("*"):
        os.utime(path, (1_000_000_000, 1_000_000_000))
    for made, umask, folder in ((one, 0o022, one.root), (other, 0o077, tmp_path)):
        build_boards(made)
        before = os.umask(umask)
        try:
            made.release("-o", made.root / "dist", "--platforms", "none", cwd=folder)
        finally:
            os.umask(before)
    ours, theirs = ({path.relative_to(folder): path for path in folder.rglob("*") if path.is_file()}
                    for folder in (one.root / "dist", other.root / "dist"))  # fmt: skip
    assert set(ours) == set(theirs)
    assert [str(name) for name in ours if ours[name].read_bytes() != theirs[name].read_bytes()] == []


def test_nothing_in_it_names_the_folder_it_was_made_in(dist: Path, tree: Tree) -> None:
    where = str(tree.root).encode()
    for path in dist.rglob("*"):
        if path.is_file():
            data = path.read_bytes()
            assert where not in data, path.name
            if path.name.endswith(".gz"):
                assert where not in gzip.decompress(data), path.name
