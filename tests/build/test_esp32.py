"""`wificnc build` of an ESP32: what is missing is reported immediately, what PlatformIO says and makes is passed on."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import cmake
import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat
from made_key import pem
from patience import HANG_S
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.environments import ENVIRONMENTS, write_environments
from wificnc.build.esp32 import (
    CONFIGURATION,
    PACKAGES,
    REACH_SECONDS,
    SIGNATURE,
    Kind,
    collect,
    configuration_lines,
    configuration_without,
    find_platformio,
    missing_packages,
    plan_build,
    registry_answers,
    require_packages,
    run_build,
    slot_bytes,
)
from wificnc.build.signing import VARIABLE, default_path, key_header_text, signing_key
from wificnc.commands import build
from wificnc.errors import BuildError, Exit

ROOT = checkout_root()
BOARD = load_board("esp32s3-zero")

# PlatformIO, as far as we call it: says something, and leaves files where it does.
FAKE = """\
import pathlib, sys
at = pathlib.Path({made!r})
at.mkdir(parents=True, exist_ok=True)
print("Compiling main.o")
if {fails}:
    print("error: main.c:1: something")
    sys.exit(1)
for name in ("firmware.bin", "firmware.elf", "bootloader.bin", "partitions.bin"):
    (at / name).write_bytes(name.encode() * 100 + bytes.fromhex({point!r}))
print("RAM:   [==        ]  14.7% (used 48240 bytes from 327680 bytes)")
"""


def fake_pio(folder: Path, fails: bool = False) -> tuple[str, ...]:
    script = folder / "pio.py"
    made, point = str(folder / ".pio" / "build" / BOARD.id), signing_key().point.hex()
    script.write_text(FAKE.format(made=made, fails=fails, point=point))
    return (sys.executable, str(script))


def test_the_call_names_project_and_board() -> None:
    plan = plan_build(BOARD, Path("/repo"), pio=("pio",))
    assert plan.argv == ("pio", "run", "-d", "/repo", "-e", "esp32s3-zero")
    assert plan.environment["WIFICNC_BOARD"] == "esp32s3-zero"
    assert plan_build(BOARD, Path("/repo"), clean=True).argv[-2:] == ("-t", "clean")


def test_a_debug_build_has_an_environment_of_its_own() -> None:
    plan = plan_build(BOARD, Path("/repo"), kind="debug")
    assert plan.argv[-2:] == ("-e", "esp32s3-zero-debug")
    assert plan.made == Path("/repo/.pio/build/esp32s3-zero-debug") and plan.output == Path("/repo/build/esp32s3-zero")


@pytest.mark.parametrize("kind", ["release", "debug"])
def test_the_kind_of_a_build_is_on_record(tmp_path: Path, kind: Kind) -> None:
    plan = replace(plan_build(BOARD, tmp_path, pio=fake_pio(tmp_path)), kind=kind)
    list(run_build(plan))
    collect(plan, {}, signing_key())
    assert json.loads((tmp_path / "build" / BOARD.id / "build.json").read_text())["kind"] == kind


def test_the_two_kinds_differ_where_they_should() -> None:
    release, debug = (configuration_lines(ROOT, "esp32s3", kind) for kind in ("release", "debug"))
    assert {"CONFIG_COMPILER_OPTIMIZATION_PERF=y", "CONFIG_LOG_DEFAULT_LEVEL_NONE=y"} <= set(release) - set(debug)
    assert {"CONFIG_COMPILER_OPTIMIZATION_DEBUG=y", "CONFIG_LOG_DEFAULT_LEVEL_INFO=y"} <= set(debug) - set(release)
    for lines in (release, debug):
        names = [line.partition("=")[0] for line in lines]
        assert len(names) == len(set(names)), "an option is listed twice"


def test_a_configuration_of_an_earlier_build_is_noticed(tmp_path: Path) -> None:
    shutil.copytree(
        ROOT / CONFIGURATION, tmp_path / CONFIGURATION, ignore=lambda _, names: [n for n in names if "." not in n]
    )
    plan = plan_build(BOARD, tmp_path)
    assert configuration_without(tmp_path, plan, BOARD.chip) == []  # there is none yet
    made = configuration_lines(tmp_path, BOARD.chip, "release")
    kept = tmp_path / "sdkconfig.esp32s3-zero"
    kept.write_text("\n".join(["# CONFIG_X is not set", *made]).replace("partitions.csv", "elsewhere.csv"))
    assert configuration_without(tmp_path, plan, BOARD.chip) == []
    kept.write_text(kept.read_text().replace("CONFIG_FREERTOS_HZ=1000", "CONFIG_FREERTOS_HZ=100"))
    assert configuration_without(tmp_path, plan, BOARD.chip) == ["CONFIG_FREERTOS_HZ=1000"]


def test_what_is_switched_off_is_read_as_kconfig_writes_it(tmp_path: Path) -> None:
    """As "# CONFIG_X is not set": `wificnc build` warned of an earlier configuration each time."""
    (tmp_path / "targets").mkdir()
    shutil.copytree(ROOT / CONFIGURATION, tmp_path / CONFIGURATION)
    plan = plan_build(BOARD, tmp_path)
    lines = configuration_lines(tmp_path, BOARD.chip, "release")
    off = "CONFIG_ESP_WIFI_RX_IRAM_OPT"
    assert f"{off}=n" in lines
    written = [f"# {line[:-2]} is not set" if line.endswith("=n") else line for line in lines]
    kept = tmp_path / "sdkconfig.esp32s3-zero"
    kept.write_text("\n".join(written))
    assert configuration_without(tmp_path, plan, BOARD.chip) == []
    kept.write_text("\n".join(written).replace(f"# {off} is not set", f"{off}=y"))
    assert configuration_without(tmp_path, plan, BOARD.chip) == [f"{off}=n"]


# What CMake gets, by a project.cmake that only repeats it.
PROJECT = 'macro(project)\nmessage(STATUS "DEFAULTS ${SDKCONFIG_DEFAULTS}")\nendmacro()\n'


@pytest.mark.parametrize("folder", [".", "targets/esp32"])
@pytest.mark.parametrize(
    ("arguments", "kind"), [([], "release"), (["-DWIFICNC_KIND=debug"], "debug"), (["-DWIFICNC_KIND=fast"], None)]
)
def test_cmake_takes_the_files_of_the_kind(tmp_path: Path, folder: str, arguments: list[str], kind: str | None) -> None:
    (tmp_path / "tools/cmake").mkdir(parents=True)
    (tmp_path / "tools/cmake/project.cmake").write_text(PROJECT)
    command = [Path(cmake.CMAKE_BIN_DIR) / "cmake", "-S", str(ROOT / folder), "-B", str(tmp_path / "build"), *arguments]
    environment = {**os.environ, "IDF_PATH": str(tmp_path)}
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, env=environment, check=False)
    if kind is None:
        assert run.returncode != 0 and "not release or debug" in run.stderr
        return
    (said,) = [line for line in run.stdout.splitlines() if line.startswith("-- DEFAULTS ")]
    names = [Path(name).name for name in said.removeprefix("-- DEFAULTS ").split(";")]
    assert names == ["sdkconfig.defaults", f"sdkconfig.{kind}", *(["sdkconfig.platformio"] if folder == "." else [])]


def test_what_is_built_is_kept_with_its_sums(tmp_path: Path) -> None:
    plan = plan_build(BOARD, tmp_path, pio=fake_pio(tmp_path))
    lines = list(run_build(plan))
    assert lines[0] == "Compiling main.o" and lines[-1].startswith("RAM:")
    artefacts = collect(plan, {"revision": "abc"}, signing_key())
    record = json.loads((tmp_path / "build" / BOARD.id / "build.json").read_text())
    assert record["board"] == BOARD.id and record["revision"] == "abc"
    for row, artefact in zip(record["artefacts"], artefacts, strict=True):
        kept = (tmp_path / "build" / BOARD.id / row["name"]).read_bytes()
        assert row["sha256"] == artefact.sha256 == hashlib.sha256(kept).hexdigest()


def test_what_is_built_is_signed(tmp_path: Path) -> None:
    """openssl says so. A firmware that carries another key could not be updated by what this one signs."""
    plan = plan_build(BOARD, tmp_path, pio=fake_pio(tmp_path))
    list(run_build(plan))
    key, there = signing_key(), tmp_path / "build" / BOARD.id
    collect(plan, {}, key)
    assert json.loads((there / "build.json").read_text())["signing_key"] == key.name
    public = key.public.public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    (tmp_path / "public.pem").write_bytes(public)
    command = ["openssl", "dgst", "-sha256", "-verify", str(tmp_path / "public.pem"), "-signature"]
    subprocess.run([*command, str(there / SIGNATURE), str(there / "firmware.bin")], check=True, timeout=HANG_S)
    with pytest.raises(BuildError, match="another signing key"):
        collect(plan, {}, signing_key({VARIABLE: pem(21)}))
    collect(plan, {}, signing_key({VARIABLE: public.decode()}))  # no private key: no signature, and no old one
    assert not (there / SIGNATURE).exists()


def test_the_own_key_is_made_once_and_is_ones_own(tmp_path: Path) -> None:
    environment = {"XDG_CONFIG_HOME": str(tmp_path)}
    first = signing_key(environment)
    path = default_path(environment)
    assert signing_key(environment).name == first.name
    assert os.name == "nt" or path.stat().st_mode & 0o777 == 0o600
    assert signing_key({VARIABLE: str(path)}).name == first.name
    signature = first.sign(b"image")
    assert signature and signature == first.sign(b"image") and first.has_signed(b"image", signature)
    assert not first.has_signed(b"other", signature) and not first.has_signed(b"image", b"")
    numbers = re.findall(r"0x([0-9A-F]{2})", key_header_text(first))
    assert bytes.fromhex("".join(numbers)) == first.point and len(first.point) == 65


@pytest.mark.parametrize("curve", [ec.SECP384R1(), ec.SECP256K1()])
def test_keys_of_other_kinds_are_refused(tmp_path: Path, curve: ec.EllipticCurve) -> None:
    other = ec.generate_private_key(curve).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    with pytest.raises(BuildError, match="P-256"):
        signing_key({VARIABLE: other.decode()})
    (tmp_path / "text").write_text("a private KEY")
    for given, why in ((str(tmp_path / "text"), "not a PEM key"), (str(tmp_path / "none"), "cannot read")):
        with pytest.raises(BuildError, match=why):
            signing_key({VARIABLE: given})


def test_a_failed_build_ends_with_its_last_words(tmp_path: Path) -> None:
    plan = plan_build(BOARD, tmp_path, pio=fake_pio(tmp_path, fails=True))
    with pytest.raises(BuildError, match=r"error: main.c:1: something"):
        list(run_build(plan))


def test_a_build_that_left_nothing_is_no_build(tmp_path: Path) -> None:
    plan = plan_build(BOARD, tmp_path, pio=(sys.executable, "-c", ""))
    list(run_build(plan))
    with pytest.raises(BuildError, match=r"firmware\.bin is missing"):
        collect(plan, {}, signing_key())


def test_missing_packages_need_the_registry(tmp_path: Path) -> None:
    assert missing_packages(tmp_path) == ["espressif32", *PACKAGES]
    with pytest.raises(BuildError, match="espressif32") as caught:
        require_packages(tmp_path, lambda: False)
    assert "wificnc build host" in str(caught.value.hint)
    require_packages(tmp_path, lambda: True)
    (tmp_path / "platforms" / "espressif32").mkdir(parents=True)
    for name in PACKAGES:
        (tmp_path / "packages" / name).mkdir(parents=True)
    require_packages(tmp_path, lambda: False)


def test_a_registry_that_drops_packets_costs_less_than_a_second() -> None:
    assert REACH_SECONDS < 1
    begin = time.monotonic()
    assert not registry_answers(("192.0.2.1", 443))  # TEST-NET-1: no one is there
    assert time.monotonic() - begin < 60, "the system itself gives up after two minutes"


def test_offline_the_command_says_what_is_missing_and_what_still_works(tmp_path: Path) -> None:
    offline = {**os.environ, "PLATFORMIO_CORE_DIR": str(tmp_path)}
    script = (
        "import wificnc.build.esp32 as e, wificnc.app as a; e.registry_answers.__defaults__ = (('192.0.2.1', 443), 0.1)"
    )
    command = [sys.executable, "-c", f"{script}; a.main(['build', 'esp32s3-zero'])"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, env=offline, check=False)
    assert run.returncode == Exit.BUILD
    assert "registry cannot be reached" in run.stderr and "wificnc build host" in run.stderr


def test_without_platformio_its_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(BuildError) as caught:
        find_platformio({"PATH": "/nowhere"})
    assert "pip install" in str(caught.value.hint)


def test_the_slot_is_the_smaller_one() -> None:
    assert slot_bytes("# name\na, app, ota_0, 0x10000, 0x20\nb, app, ota_1, 0x20000, 0x10\nc, data, nvs, 0, 1\n") == 16
    assert slot_bytes((ROOT / "targets/esp32/partitions.csv").read_text()) == 0x1E0000


def values_of(chip: str) -> dict[str, str]:
    lines = configuration_lines(ROOT, chip, "release")
    return {option: value for option, _, value in (line.partition("=") for line in lines)}


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_wifis_reception_lies_in_flash(chip: str) -> None:
    """13 KB of the memory for instructions, on the ESP32-S3 of that for data, too: with them each of its boards was
    over the budget of `wificnc build`."""
    assert values_of(chip)["CONFIG_ESP_WIFI_RX_IRAM_OPT"] == "n"


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_code_comes_from_flash_at_80_mhz(chip: str) -> None:
    """The task side plans from flash. At 40 MHz a line of the ESP32's cache takes 3.8 us and motion braked: a job of a
    diagonal and two arcs took 12.9 s instead of 9.8 s (docs/performance.md)."""
    values = values_of(chip)
    clocks = [option for option in values if option.startswith("CONFIG_ESPTOOLPY_FLASHFREQ_")]
    assert clocks == ["CONFIG_ESPTOOLPY_FLASHFREQ_80M"] and values[clocks[0]] == "y"


def test_the_s3_has_32_kb_of_cache_for_code() -> None:
    """Both cores share it. With ESP-IDF's 16 KB the same job took 17.5 s (docs/performance.md)."""
    values = values_of("esp32s3")
    assert values["CONFIG_ESP32S3_INSTRUCTION_CACHE_32KB"] == "y"
    assert not [option for option in values if option.startswith("CONFIG_ESP32S3_INSTRUCTION_CACHE_16KB")]


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_what_our_interrupts_use_of_esp_idf_stays_in_ram(chip: str) -> None:
    """They run while the flash is written: GPIO, the UART's driver with its ring buffer, timers, FreeRTOS."""
    values = values_of(chip)
    assert values["CONFIG_GPIO_CTRL_FUNC_IN_IRAM"] == values["CONFIG_UART_ISR_IN_IRAM"] == "y"
    for option in (
        "CONFIG_ESP_TIMER_IN_IRAM",
        "CONFIG_RINGBUF_PLACE_ISR_FUNCTIONS_INTO_FLASH",
        "CONFIG_FREERTOS_PLACE_FUNCTIONS_INTO_FLASH",
    ):
        assert option not in values, f"{option}: ESP-IDF's default has it in RAM"


def test_the_environments_are_there_before_platformio_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PlatformIO reads them first of all. In a fresh tree, and not written again when they are right."""

    def run(plan: object) -> list[str]:
        assert f"[env:{BOARD.id}-debug]\n" in (tmp_path / ENVIRONMENTS).read_text(encoding="utf-8")
        raise BuildError("far enough")

    monkeypatch.setattr(build, "checkout_root", lambda: tmp_path)
    monkeypatch.setattr(build.esp32, "find_platformio", lambda: ("pio",))
    monkeypatch.setattr(build.esp32, "require_packages", lambda core: None)
    monkeypatch.setattr(build.esp32, "run_build", run)
    for _ in range(2):
        with pytest.raises(BuildError, match="far enough"):
            build.build_board(BOARD, "debug", clean=False, verbose=False)
        written = (tmp_path / ENVIRONMENTS).stat().st_mtime_ns
    write_environments(tmp_path)
    assert (tmp_path / ENVIRONMENTS).stat().st_mtime_ns == written


def test_the_project_includes_the_environments() -> None:
    assert f"\nextra_configs = {ENVIRONMENTS.as_posix()}\n" in (ROOT / "platformio.ini").read_text(encoding="utf-8")
