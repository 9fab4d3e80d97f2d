"""NVS images: written by Espressif's generator, read by our reader; damage, newer layouts, secrets, differences."""

from __future__ import annotations

import random
import string
import struct
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("esp_idf_nvs_partition_gen")

from patience import HANG_S
from wificnc.errors import BuildError, FlashError, UserError
from wificnc.firmware.nvs.build import PARTITION_SIZE, build_image
from wificnc.firmware.nvs.image import FORMATS, PAGE, Entry, NvsImage, read_image
from wificnc.firmware.nvs.values import (
    HIDDEN,
    NAMESPACE,
    differences,
    machine_entries,
    merged,
    number_entry,
    random_password,
    rows,
    setting_keys,
    text_entry,
    without,
)
from wificnc.profile import find_machines, load_machine


def image_of(*entries: Entry) -> NvsImage:
    return read_image(build_image(entries))


def test_every_type_and_size_comes_back() -> None:
    rng = random.Random(1)
    entries = []
    for index, (kind, pattern) in enumerate(FORMATS.items()):
        bits = 8 * struct.calcsize(pattern)
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if kind[0] == "i" else (0, 2**bits - 1)
        entries += [
            Entry("a", f"{kind}{n}", kind, value) for n, value in enumerate((low, high, rng.randint(low, high)))
        ]
        entries.append(Entry("b", f"text{index}", "string", "".join(rng.choices(string.printable[:95], k=30 * index))))
    entries.append(Entry("b", "long", "blob", rng.randbytes(5000)))  # over two pages
    entries.append(Entry("b", "short", "blob", b"\0\1"))
    image = read_image(build_image(entries))
    assert image.damaged == []
    assert image.entries == {(entry.namespace, entry.key): entry for entry in entries}


@pytest.mark.parametrize("name", sorted(find_machines()))
def test_profiles_become_settings_under_the_firmwares_keys(name: str) -> None:
    machine = load_machine(name)
    image = image_of(*machine_entries(machine))
    keys = {key.number: key for key in setting_keys()}
    for number, value in machine.settings().items():
        stored = image.get(NAMESPACE, keys[number].key)
        assert isinstance(stored, int)
        if keys[number].type == "float":
            stored = struct.unpack("<f", struct.pack("<I", stored))[0]
            assert stored == struct.unpack("<f", struct.pack("<f", value))[0]
        else:
            assert stored == value


def test_what_is_written_later_counts() -> None:
    """A key of a newer page replaces the one of an older page."""
    old = bytearray(build_image([Entry("wificnc", "dev_mode", "u8", 0)]))
    new = build_image([Entry("wificnc", "dev_mode", "u8", 1)])[:PAGE]
    page = bytearray(new)
    struct.pack_into("<I", page, 4, 7)  # sequence
    import zlib

    struct.pack_into("<I", page, 28, zlib.crc32(page[4:28], 0xFFFFFFFF))
    old[PAGE : 2 * PAGE] = page
    assert read_image(bytes(old)).get("wificnc", "dev_mode") == 1


def test_a_damaged_byte_costs_its_entry_and_is_told() -> None:
    good = build_image([Entry("wificnc", f"k{n}", "u32", n) for n in range(20)])
    whole = read_image(good).entries
    for at in range(0, 64 + 21 * 32):
        if 32 <= at < 64:
            continue  # the bitmap has no checksum
        bad = bytearray(good)
        bad[at] ^= 0x10
        try:
            image = read_image(bytes(bad))
        except FlashError:
            continue
        changed = {where for where, entry in image.entries.items() if whole.get(where) != entry}
        assert not changed, f"byte {at} changes {changed} unnoticed"
        assert image.damaged or 0 <= at < 4 or 8 < at < 28, at


@pytest.mark.parametrize(
    ("data", "said"),
    [(b"\0" * 100, "multiple of"), (b"hello world!" * 2048, "not an NVS partition"), (b"", "multiple of")],
)
def test_other_files_are_refused(data: bytes, said: str) -> None:
    with pytest.raises(FlashError, match=said):
        read_image(data)


def test_an_empty_partition_is_empty() -> None:
    assert read_image(b"\xff" * PARTITION_SIZE) == NvsImage()


def test_a_newer_layout_is_refused_with_the_way_out() -> None:
    data = bytearray(build_image([Entry("wificnc", "dev_mode", "u8", 1)]))
    data[8] = 0xFD
    import zlib

    struct.pack_into("<I", data, 28, zlib.crc32(data[4:28], 0xFFFFFFFF))
    with pytest.raises(FlashError, match="newer layout") as caught:
        read_image(bytes(data))
    assert caught.value.hint and "upgrade" in caught.value.hint


def test_too_much_for_the_partition_is_told() -> None:
    with pytest.raises(BuildError):
        build_image([Entry("a", f"k{n}", "blob", bytes(3000)) for n in range(8)])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("wifi_ssid", "x" * 33),
        ("wifi_ssid", ""),
        ("wifi_ssid", "ü" * 17),
        ("wifi_pass", "1234567"),
        ("access_key", ""),
    ],
)
def test_texts_of_a_wrong_length_are_refused(key: str, value: str) -> None:
    with pytest.raises(UserError, match=key):
        text_entry(key, value)


@pytest.mark.parametrize("text", ["dev_mode=2", "p_sx=-1", "p_sx=256", "p_sx=", "nonsense=1", "p_sx"])
def test_wrong_numbers_and_keys_are_refused(text: str) -> None:
    with pytest.raises(UserError):
        number_entry(text)


@pytest.mark.parametrize(
    "text", ["io_dir=0x10000", "io_dir=0x", "io_dir=FF", "io_count=17", "io_p16=1", "io_lost_ms=99"]
)
def test_wrong_channels_are_refused(text: str) -> None:
    with pytest.raises(UserError):
        number_entry(text)


def test_channels_of_an_io_module_are_kept_with_their_width() -> None:
    entries = [number_entry(text) for text in ("io_dir=0xFF00", "io_lost_ms=60000", "io_count=16", "io_p15=4")]
    assert [(entry.key, entry.type, entry.value) for entry in entries] == [
        ("io_dir", "u16", 0xFF00), ("io_lost_ms", "u16", 60000), ("io_count", "u8", 16), ("io_p15", "u8", 4),
    ]  # fmt: skip
    assert image_of(*entries).get(NAMESPACE, "io_dir") == 0xFF00


def test_secrets_are_masked_unless_asked_for() -> None:
    image = image_of(text_entry("wifi_ssid", "Werkstatt"), text_entry("wifi_pass", "12345678"))
    assert {row.key: row.value for row in rows(image, False)} == {"wifi_ssid": "Werkstatt", "wifi_pass": HIDDEN}
    assert {row.key: row.value for row in rows(image, True)}["wifi_pass"] == "12345678"
    other = image_of(text_entry("wifi_ssid", "Werkstatt"), text_entry("wifi_pass", "87654321"))
    ((key, _, one, two),) = differences(image, other, False)
    assert (key, one, two) == ("wifi_pass", HIDDEN, HIDDEN)


def test_merging_keeps_what_it_does_not_change() -> None:
    image = image_of(Entry("nvs.net80211", "cal", "blob", bytes(range(64))), number_entry("dev_mode=0"))
    both = image_of(*merged(image, [number_entry("dev_mode=1"), number_entry("p_sx=255")]))
    assert both.get("nvs.net80211", "cal") == bytes(range(64))
    assert both.get(NAMESPACE, "dev_mode") == 1 and both.get(NAMESPACE, "p_sx") == 255
    assert without(both, ["p_sx"]).get(NAMESPACE, "p_sx") is None


def test_made_passwords_differ_and_are_long_enough() -> None:
    made = {random_password() for _ in range(100)}
    assert len(made) == 100 and all(text_entry("ap_pass", password) for password in made)


def test_the_partition_is_the_one_of_the_table(request: pytest.FixtureRequest) -> None:
    table = (Path(request.config.rootpath) / "targets/esp32/partitions.csv").read_text()
    row = next(line.split(",") for line in table.splitlines() if line.startswith("nvs,"))
    assert int(row[4], 0) == PARTITION_SIZE


def test_esptool_can_be_used_after_the_generator() -> None:
    """Both log through Espressif's esp-pylib, and the first one decides whose logger that has."""
    program = (
        "from wificnc.firmware.flash.device import quiet_esptool\n"
        "from wificnc.firmware.nvs.build import build_image\n"
        "build_image([])\n"
        "quiet_esptool().logger.log.note('never shown')\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
