"""A firmware installed from the page: Chromium, the firmware's own server and receiver, and a slot that is a file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from chip import image
from playwright.sync_api import Page, expect
from update_page import Receiver, receiver
from web_fixture import Watched
from wificnc.build.signing import signing_key
from wificnc.firmware.page_header import embedded_files

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

KEY = "correct horse"
BOARD = "esp32s3-devkitc"
NAME = f"wificnc-1.2.3-{BOARD}-firmware.bin"


def firmware(board: str = BOARD, size: int = 150_000, chip: str = "esp32s3") -> bytes:
    """With what the real one answers to GET api/controller."""
    made = image(chip, size)
    about = f'"version": "1.2.3", "board": "{board}", "axes": 3'.encode()
    return made[:1000] + about + made[1000 + len(about) :]


@pytest.fixture
def there(built_page: Path, tmp_path: Path) -> Iterator[Receiver]:
    with receiver(KEY, tmp_path / "slot.bin", embedded_files(built_page)) as running:
        yield running


@pytest.fixture
def page(there: Receiver, watched: Callable[..., Watched]) -> Iterator[Page]:
    with watched() as browser:
        opened = browser.page(f"http://127.0.0.1:{there.page}/#network")
        expect(opened.get_by_role("heading", name="Update the firmware")).to_be_visible()
        yield opened


def choose(page: Page, data: bytes, signature: bytes | None = None, **more: bytes) -> None:
    signed = (signing_key().sign(data) or b"") if signature is None else signature
    files = {NAME: data, NAME.replace(".bin", ".sig"): signed, **more}
    page.locator("[data-test=update-files]").set_input_files(
        [{"name": name, "mimeType": "", "buffer": content} for name, content in files.items()]
    )


def install(page: Page, key: str = KEY) -> None:
    page.locator("[data-test=update-key]").fill(key)
    page.locator("[data-test=update-send]").click()


def refused(page: Page, text: str) -> None:
    expect(page.get_by_role("alert").filter(has_text=text)).to_be_visible()


def index(data: bytes) -> bytes:
    row = {"path": f"{BOARD}/{NAME}", "size": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    return json.dumps({"schema": 1, "boards": [{"id": BOARD, "files": [row]}]}).encode()


def test_a_firmware_is_installed_and_reached(there: Receiver, page: Page) -> None:
    data = firmware()
    choose(page, data, **{"index.json": index(data)})
    install(page)
    expect(page.get_by_text("The new firmware runs and stays")).to_be_visible()
    assert there.slot.read_bytes() == data


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (firmware("mks-tinybee"), "is for the board mks-tinybee, and this controller is a esp32s3-devkitc"),
        (image("esp32s3", 150_000), "is not a firmware of WiFiCNC"),
        (b"\x7fELF" + bytes(1000), "is not a firmware image of an ESP32"),
    ],
)
def test_the_page_refuses_what_is_no_firmware_for_this_board(
    there: Receiver, page: Page, data: bytes, text: str
) -> None:
    choose(page, data)
    refused(page, text)
    expect(page.locator("[data-test=update-send]")).to_have_count(0)
    assert not there.slot.exists()


def test_the_old_firmware_that_has_returned_is_no_success(there: Receiver, page: Page) -> None:
    there.return_to_old()
    choose(page, firmware())
    install(page)
    refused(page, "The old firmware has returned")
    expect(page.get_by_text("The new firmware runs and stays")).to_have_count(0)


def test_firmware_for_another_board_is_installed_only_on_purpose(there: Receiver, page: Page) -> None:
    data = firmware("mks-tinybee")
    page.get_by_label("Allow firmware for another board").check()
    choose(page, data)
    install(page)
    expect(page.get_by_text("The new firmware runs and stays")).to_be_visible()
    assert there.slot.read_bytes() == data


def test_a_missing_signature_and_a_damaged_file_are_refused(page: Page) -> None:
    data = firmware()
    choose(page, data, signature=b"0\x06\x02\x01\x05\x02\x01")
    refused(page, "is not a signature of a firmware")
    choose(page, data[:-1] + bytes([data[-1] ^ 1]), **{"index.json": index(data)})
    refused(page, "is damaged: index.json has another size or SHA-256")


def test_the_controllers_refusals_are_shown(there: Receiver, page: Page) -> None:
    """The old firmware runs on, and the files need not be chosen again."""
    data = firmware()
    choose(page, data)
    install(page, "wrong horse")
    refused(page, "wrong access key")
    choose(page, data, signing_key().sign(data + b"x"))
    install(page)
    refused(page, "not signed with the key of the firmware that runs")
    choose(page, firmware(chip="esp32"))
    install(page)
    refused(page, "this firmware is for another chip")
    choose(page, firmware(size=250_000))
    install(page)
    refused(page, "the image is larger than its slot")
    assert not there.slot.exists()
    choose(page, data)
    install(page)
    expect(page.get_by_text("The new firmware runs and stays")).to_be_visible()
