"""Firmware, and what a board has stored, over a stand-in for `navigator.serial` at a mock of an ESP32's loader."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from bridge import Bridge
from chip import Mock, image, make_build, mock_chip
from playwright.sync_api import Page, expect
from web_fixture import Watched
from wificnc.board.load import load_board
from wificnc.firmware.flash.device import open_device
from wificnc.firmware.flash.plan import Region, load_regions, read_partitions
from wificnc.firmware.nvs.build import build_image
from wificnc.firmware.nvs.image import read_image
from wificnc.firmware.nvs.values import NAMESPACE, machine_entries, number_entry, text_entry
from wificnc.firmware.release.esp32 import Esp32Firmware
from wificnc.firmware.release.flasher_page import esp32_files, index, index_row
from wificnc.profile import load_machine
from wificnc.simulator.serve.options import Address
from wificnc.simulator.serve.page import About, PageServer

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

ROOT = Path(__file__).resolve().parents[2]
PARTITIONS = read_partitions((ROOT / "targets/esp32/partitions.csv").read_text())
NVS = PARTITIONS["nvs"]
# Before the page: esptool-js waits 3 s by this clock for an answer, and the mock of the chip shares a busy computer.
SLOW_CLOCK = "{ const now = Date.now, zero = now(); Date.now = () => zero + (now() - zero) / 100; }"


@dataclass
class Bench:
    """A page with firmware next to it, and a chip that is plugged in."""

    page: Page
    chip: Mock
    folder: Path
    bridge: Bridge

    def install(self, board_id: str) -> None:
        self.page.click("#tab-install")
        self.page.click(f"[data-test=board-{board_id}]")
        self.page.click("[data-test=install]")

    def flash(self, regions: tuple[Region, ...]) -> list[bytes]:
        """What lies in the chip's flash there, read by esptool."""
        self.bridge.unplug()
        with open_device(self.chip.port) as device:
            return [device.read(region.offset, len(region.data)) for region in regions]


def firmware_of(tmp_path: Path, board_id: str, chip: str) -> Esp32Firmware:
    build = make_build(tmp_path / f"build-{board_id}", board_id, chip)
    regions = tuple(load_regions(build, load_board(board_id), PARTITIONS))
    return Esp32Firmware(regions, b"", b"", b"", b"", flash_mb=4, has_improv=False)


def write_firmware(folder: Path, boards: dict[str, Esp32Firmware]) -> None:
    """firmware/ as `wificnc release` makes it."""
    rows = []
    for board_id, firmware in boards.items():
        board = load_board(board_id)
        files = esp32_files(board, "1.0", firmware)
        for name, data in files.items():
            path = folder / "firmware" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        rows.append(index_row(board, files, None, firmware.flash_mb))
    (folder / "firmware" / "index.json").write_bytes(index("1.0", "", rows))


@pytest.fixture
def bench(
    built_page: Path, watched: Callable[..., Watched], bridge: Bridge, tmp_path: Path
) -> Iterator[Callable[..., object]]:
    @contextmanager
    def make(chip: str, boards: dict[str, Esp32Firmware]) -> Iterator[Bench]:
        folder = tmp_path / "host"
        shutil.copytree(built_page, folder)
        write_firmware(folder, boards)
        about = About("", "", "", 0)
        with (
            mock_chip(chip, tmp_path / "mock") as mock,
            PageServer(Address("127.0.0.1", 0), None, about, folder) as host,
            watched(bypass_csp=True) as context,  # the stand-in's WebSocket is no part of the page
        ):
            context.context.add_init_script(SLOW_CLOCK)
            context.context.add_init_script(bridge.stand_in(Path(mock.port)))
            yield Bench(context.page(host.url), mock, folder, bridge)
            bridge.unplug()

    yield make


@pytest.mark.parametrize(("board_id", "chip"), [("esp32-wroom32", "esp32"), ("esp32s3-zero", "esp32s3")])
def test_a_board_is_installed(bench: Callable[..., object], tmp_path: Path, board_id: str, chip: str) -> None:
    firmware = firmware_of(tmp_path, board_id, chip)
    with bench(chip, {board_id: firmware}) as table:  # type: ignore[attr-defined]
        table.install(board_id)
        expect(table.page.get_by_text("Installed and verified")).to_be_visible()
        assert table.flash(firmware.regions) == [region.data for region in firmware.regions]


def test_a_visitor_reads_nothing_of_the_computer_that_built(
    built_page: Path, watched: Callable[..., Watched], tmp_path: Path
) -> None:
    """Why a release has no firmware for a board is a message for who made it."""
    folder, board = tmp_path / "host", load_board("esp32s3-zero")
    shutil.copytree(built_page, folder)
    (folder / "firmware").mkdir(exist_ok=True)
    why = "it was built from 0123abc, and this is 4567def: `wificnc build esp32s3-zero`"
    (folder / "firmware" / "index.json").write_bytes(index("1.0", "", [index_row(board, {}, why, None)]))
    with PageServer(Address("127.0.0.1", 0), None, About("", "", "", 0), folder) as host, watched() as context:
        page = context.page(host.url)
        page.click("#tab-install")
        page.click("[data-test=board-esp32s3-zero]")
        expect(page.get_by_text("No firmware for this board")).to_be_visible()
        expect(page.get_by_text("Build it on your computer")).to_be_visible()
        expect(page.get_by_text("0123abc")).to_have_count(0)
        expect(page.locator("[data-test=install]")).to_be_disabled()


def test_one_merged_image(bench: Callable[..., object], tmp_path: Path) -> None:
    """Of one piece from address 0, for a chip whose loader begins there."""
    parts = firmware_of(tmp_path, "esp32s3-zero", "esp32s3").regions
    merged = bytearray(b"\xff" * max(part.end for part in parts))
    for part in parts:
        merged[part.offset : part.end] = part.data
    whole = (Region("merged", 0, bytes(merged)),)
    firmware = Esp32Firmware(whole, b"", b"", b"", b"", flash_mb=4, has_improv=False)
    with bench("esp32s3", {"esp32s3-zero": firmware}) as table:  # type: ignore[attr-defined]
        table.install("esp32s3-zero")
        expect(table.page.get_by_text("Installed and verified")).to_be_visible()
        assert table.flash(whole) == [bytes(merged)]


def test_another_chip_is_refused_before_anything_is_written(bench: Callable[..., object], tmp_path: Path) -> None:
    firmware = firmware_of(tmp_path, "esp32s3-zero", "esp32s3")
    with bench("esp32", {"esp32s3-zero": firmware}) as table:  # type: ignore[attr-defined]
        table.install("esp32s3-zero")
        expect(table.page.get_by_role("alert").filter(has_text="This is an ESP32, and")).to_be_visible()
        assert table.flash(firmware.regions[:1]) == [b"\xff" * len(firmware.regions[0].data)]


def test_a_damaged_part_is_refused_before_the_board_is_asked(bench: Callable[..., object], tmp_path: Path) -> None:
    firmware = firmware_of(tmp_path, "esp32s3-zero", "esp32s3")
    with bench("esp32s3", {"esp32s3-zero": firmware}) as table:  # type: ignore[attr-defined]
        part = table.folder / "firmware" / "esp32s3-zero" / "firmware.bin"
        data = bytearray(part.read_bytes())
        data[1000] ^= 1
        part.write_bytes(data)
        table.install("esp32s3-zero")
        expect(table.page.get_by_role("alert").filter(has_text="firmware.bin is damaged")).to_be_visible()
        assert table.page.evaluate("window.serialSignals ?? []") == []


def test_unplugged_in_the_middle(bench: Callable[..., object], tmp_path: Path) -> None:
    big = image("esp32s3", 1_500_000)
    regions = (*firmware_of(tmp_path, "esp32s3-zero", "esp32s3").regions[:3], Region("firmware", 0x20000, big))
    firmware = Esp32Firmware(regions, b"", b"", b"", b"", flash_mb=4, has_improv=False)
    with bench("esp32s3", {"esp32s3-zero": firmware}) as table:  # type: ignore[attr-defined]
        table.install("esp32s3-zero")
        expect(table.page.get_by_text("Writing", exact=True)).to_be_visible()
        table.bridge.unplug()
        alert = table.page.get_by_role("alert").filter(has_text="Writing failed")
        expect(alert).to_be_visible()
        expect(alert).to_contain_text("reconnect the board and install again")
        table.bridge.plug()
        table.page.click("[data-test=install]")
        expect(table.page.get_by_text("Installed and verified")).to_be_visible()


# ---- what is stored ----


def stored_image() -> bytes:
    entries = [
        *machine_entries(load_machine("shapeoko3")),
        number_entry("p_sx=4"),
        text_entry("wifi_ssid", "Werkstatt"),
    ]
    return build_image(entries)


def test_pins_and_network_are_changed_in_a_file(
    built_page: Path, watched: Callable[..., Watched], tmp_path: Path
) -> None:
    """Espressif's own generator made the image, and our own reader sees that all the rest stays."""
    before = tmp_path / "nvs.bin"
    before.write_bytes(stored_image())
    with PageServer(Address("127.0.0.1", 0), None, About("", "", "", 0), built_page) as host, watched() as context:
        page = context.page(host.url)
        page.click("#tab-pins")
        page.get_by_label("Board", exact=True).select_option("esp32s3-zero")
        page.set_input_files("[data-test=storage-file]", before)
        expect(page.get_by_text("What nvs.bin has stored")).to_be_visible()
        illegal = page.locator("[data-test=pin-p_sy] option", has_text="GPIO19")
        expect(illegal).to_have_count(0)
        options = page.locator("[data-test=pin-p_prb] option:not([disabled])")
        free = options.filter(has_not_text="swap with").last.get_attribute("value")
        page.locator("[data-test=pin-p_prb]").select_option(free)
        page.click("#tab-network")
        page.fill("[data-test=text-wifi_pass]", "short")
        expect(page.get_by_text("5 bytes, but it takes 8 to 63").first).to_be_visible()
        page.fill("[data-test=text-wifi_pass]", "long enough")
        with page.expect_download() as download:
            page.click("[data-test=storage-save]")
        download.value.save_as(tmp_path / "after.bin")
    old, new = read_image(before.read_bytes()), read_image((tmp_path / "after.bin").read_bytes())
    assert new.damaged == []
    assert free is not None
    changed = {key: entry.value for key, entry in new.entries.items() if old.entries.get(key) != entry}
    assert changed == {(NAMESPACE, "p_prb"): int(free), (NAMESPACE, "wifi_pass"): "long enough"}
    assert old.entries.keys() <= new.entries.keys()


def test_channels_of_a_module_are_changed_in_a_file(
    built_page: Path, watched: Callable[..., Watched], tmp_path: Path
) -> None:
    before = tmp_path / "nvs.bin"
    before.write_bytes(stored_image())
    with PageServer(Address("127.0.0.1", 0), None, About("", "", "", 0), built_page) as host, watched() as context:
        page = context.page(host.url)
        page.click("#tab-inout")
        page.get_by_label("Board", exact=True).select_option("esp32s3-zero")
        page.set_input_files("[data-test=storage-file]", before)
        page.get_by_label("This board is an I/O expansion module").check()
        page.fill("[data-test=io_count]", "2")
        page.keyboard.press("Tab")
        page.locator("[data-test=pin-io_p0]").select_option("4")
        page.get_by_label("Direction of channel 1").select_option("1")
        expect(page.locator("[data-test=pin-io_p1] option", has_text="GPIO19")).to_have_count(0)
        expect(page.locator("[data-test=pin-io_p1] option[value='4']")).to_have_count(0)
        page.locator("[data-test=pin-io_p1]").select_option("11")
        page.get_by_label("Inversion of channel 1").check()
        page.get_by_label("Pull-up of channel 0").uncheck()
        with page.expect_download() as download:
            page.click("[data-test=storage-save]")
        download.value.save_as(tmp_path / "after.bin")
    old, new = read_image(before.read_bytes()), read_image((tmp_path / "after.bin").read_bytes())
    changed = {key[1]: (entry.type, entry.value) for key, entry in new.entries.items() if old.entries.get(key) != entry}
    assert new.damaged == []
    assert changed == {
        "dev_mode": ("u8", 1), "io_count": ("u8", 2), "io_p0": ("u8", 4), "io_p1": ("u8", 11),
        "io_dir": ("u16", 2), "io_invert": ("u16", 2), "io_pull": ("u16", 0xFFFE),
    }  # fmt: skip


def test_pins_are_read_from_a_board_and_written_back(bench: Callable[..., object], tmp_path: Path) -> None:
    firmware = firmware_of(tmp_path, "esp32s3-zero", "esp32s3")
    with bench("esp32s3", {"esp32s3-zero": firmware}) as table:  # type: ignore[attr-defined]
        table.bridge.unplug()
        with open_device(table.chip.port) as device:
            device.write([Region("settings", NVS.offset, stored_image())], 115200, lambda *_: None)
        table.bridge.plug()
        page = table.page
        page.click("#tab-network")
        page.get_by_label("Board", exact=True).select_option("esp32s3-zero")
        page.click("[data-test=storage-read]")
        expect(page.locator("[data-test=text-wifi_ssid]")).to_have_value("Werkstatt")
        page.fill("[data-test=text-wifi_ssid]", "Keller")
        page.click("[data-test=storage-write]")
        expect(page.get_by_text("Written and verified")).to_be_visible()
        (after,) = table.flash((Region("settings", NVS.offset, bytes(NVS.size)),))
    assert read_image(after).get(NAMESPACE, "wifi_ssid") == "Keller"
    assert json.dumps(sorted(read_image(after).entries)) == json.dumps(sorted(read_image(stored_image()).entries))
