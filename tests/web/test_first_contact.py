"""First contact in Chromium at phone width: the firmware's name server leads the browser to the firmware's page, which
gives the controller a network, and takes it back when no client comes through it."""

from __future__ import annotations

import shutil
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from esp32_serve import Contact, first_contact
from patience import HANG_S
from playwright.sync_api import Browser, Page, expect
from web_fixture import CHROMIUM, TIMEOUT_MS
from wificnc.firmware.page_header import embedded_files

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built

PHONE = {"width": 360, "height": 740}
KEY = "correct horse"
CHECK = "http://connectivitycheck.gstatic.com/generate_204"  # what Android asks for
OWN, WORKSHOP = "192.168.4.1", "192.168.1.20"
AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"


def address_of(contact: Contact, name: str) -> str:
    """What the controller's name server answers to a phone."""
    labels = b"".join(bytes([len(label)]) + label.encode() for label in name.split("."))
    query = struct.pack(">6H", 7, 0x0100, 1, 0, 0, 0) + labels + struct.pack(">xHH", 1, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.settimeout(HANG_S)
        one.sendto(query, ("127.0.0.1", contact.names))
        return socket.inet_ntoa(one.recv(512)[-4:])


@pytest.fixture
def contact(built_page: Path) -> Iterator[Contact]:
    with first_contact(KEY, embedded_files(built_page)) as running:
        yield running


@pytest.fixture
def phone(contact: Contact, browser: Browser) -> Iterator[Browser]:
    """A phone: every name is what the controller's name server says, and both of its networks have the controller."""
    program = next(filter(None, map(shutil.which, CHROMIUM)))
    found = address_of(contact, "connectivitycheck.gstatic.com")
    rules = ", ".join(f"MAP {name} {found}:{contact.page}" for name in ("*.gstatic.com", "*.local", OWN, WORKSHOP))
    options = ["--no-sandbox", f"--host-resolver-rules={rules}, MAP * ~NOTFOUND", "--disable-features=HttpsUpgrades"]
    chromium = browser.browser_type.launch(executable_path=program, args=options)
    yield chromium
    chromium.close()


@pytest.fixture
def page(phone: Browser) -> Iterator[Page]:
    context = phone.new_context(viewport=PHONE, has_touch=True, is_mobile=True)  # type: ignore[arg-type]
    context.set_default_timeout(TIMEOUT_MS)
    opened = context.new_page()
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.goto(CHECK)
    yield opened
    context.close()
    assert errors == []


def notice(page: Page, text: str) -> None:
    expect(page.get_by_role("status")).to_contain_text(text)


def search(page: Page, contact: Contact) -> None:
    """The search that the page begins: the radio's time passes once it is under way."""
    expect(page.get_by_role("button", name="Searching")).to_be_visible()
    contact.pass_s(3)


def give(page: Page, contact: Contact, network: str, password: str) -> None:
    search(page, contact)
    page.get_by_role("button", name=network).tap()
    page.get_by_label("Password", exact=True).fill(password)
    page.get_by_role("button", name="Connect the controller").tap()


def test_a_phone_gives_the_controller_its_network_and_keeps_it(contact: Contact, page: Page) -> None:
    expect(page).to_have_url(f"http://{OWN}/setup.html")
    expect(page.get_by_role("heading", name="WiFi of WiFiCNC-1A2B")).to_be_visible()
    give(page, contact, "Werkstatt", "half past eight!")
    notice(page, "The controller joins Werkstatt")
    contact.pass_s(5)
    notice(page, "WiFiCNC-1A2B has joined Werkstatt")
    link = page.get_by_role("link", name=f"http://{WORKSHOP}/")
    expect(page.get_by_role("link", name="http://WiFiCNC-1A2B.local/")).to_be_visible()
    contact.tell("phone other")  # as the page says
    link.tap()
    notice(page, "The controller stays in Werkstatt")
    assert contact.pass_s(300).startswith("Werkstatt own=0 joined=1")
    expect(page).to_have_url(f"http://{WORKSHOP}/setup.html")  # the ticket is not left in the history
    page.get_by_role("link", name="Open the controller").tap()
    expect(page).to_have_title("WiFiCNC")


def test_a_wrong_password_is_said_and_typed_again(contact: Contact, page: Page) -> None:
    give(page, contact, "Werkstatt", "half past nine")
    notice(page, "The controller joins Werkstatt")
    contact.pass_s(5)
    notice(page, "The network does not accept this password.")
    password = page.get_by_label("Password", exact=True)
    expect(password).to_be_focused()
    expect(password).to_have_attribute("aria-invalid", "true")
    password.fill("half past eight!")
    page.get_by_role("button", name="Connect the controller").tap()
    notice(page, "The controller joins Werkstatt")
    contact.pass_s(70)  # the pause after several failures
    notice(page, "WiFiCNC-1A2B has joined Werkstatt")


def test_if_nobody_comes_the_network_before_returns(contact: Contact, page: Page) -> None:
    give(page, contact, "Freifunk", "")
    notice(page, "The controller joins Freifunk")
    contact.pass_s(5)
    notice(page, "WiFiCNC-1A2B has joined Freifunk")
    contact.pass_s(130)
    notice(page, "The page was not opened in the new network: the settings before are back.")
    assert contact.tell("state").startswith("none own=1")
    expect(page.get_by_role("button", name="Connect the controller")).to_be_visible()


def test_what_is_refused_is_said_at_its_field(contact: Contact, page: Page) -> None:
    give(page, contact, "Werkstatt", "short")
    notice(page, "A password has 8 to 63 characters")
    page.get_by_label("Password", exact=True).fill("half past eight!")
    page.get_by_text("Name and address of the controller").tap()
    page.get_by_label("Static address").check()
    page.get_by_label("Address", exact=True).fill("192.168.1.50")
    page.get_by_label("Netmask").fill("255.0.255.0")
    page.get_by_role("button", name="Connect the controller").tap()
    notice(page, "Address, netmask and gateway do not fit together.")
    expect(page.get_by_label("Address", exact=True)).to_have_attribute("aria-invalid", "true")
    assert contact.tell("state").startswith("none")
    page.get_by_label("Netmask").fill("255.255.255.0")
    page.get_by_label("Gateway").fill("192.168.1.1")
    page.get_by_role("button", name="Connect the controller").tap()
    notice(page, "The controller joins Werkstatt")


def test_in_another_network_the_access_key_is_asked_for(contact: Contact, page: Page) -> None:
    contact.tell("phone other")
    page.goto(f"http://{WORKSHOP}/setup.html")
    page.get_by_label("Network", exact=True).fill("Werkstatt")
    page.get_by_label("Password", exact=True).fill("half past eight!")
    page.get_by_role("button", name="Connect the controller").tap()
    notice(page, "This is not the access key.")
    page.get_by_label("Access key").fill(KEY)
    page.get_by_role("button", name="Connect the controller").tap()
    notice(page, "Werkstatt is on trial")
    contact.pass_s(5)
    page.get_by_role("button", name="Keep this network").tap()
    notice(page, "The controller stays in Werkstatt")
    assert contact.tell("state").startswith("Werkstatt own")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone_and_has_no_fault_of_accessibility(contact: Contact, page: Page, scheme: str) -> None:
    page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
    search(page, contact)
    expect(page.get_by_role("button", name="Werkstatt")).to_be_visible()
    page.get_by_text("Name and address of the controller").tap()
    page.get_by_label("Static address").check()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    small = """[...document.querySelectorAll("button, input, summary, a")].filter((e) => e.getClientRects().length
      && e.type !== "checkbox" && e.getBoundingClientRect().height < 40).map((e) => e.outerHTML)"""
    assert page.evaluate(small) == []
    page.evaluate(AXE.read_text())
    faults = page.evaluate("async () => (await axe.run()).violations.map((v) => v.id + ': ' + v.nodes[0].html)")
    assert faults == []
    page.screenshot(path=f"build/tests/first-contact-{scheme}.png", full_page=True)
