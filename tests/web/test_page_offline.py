"""From an https address the page can be installed, starts without a network, and keeps to one version."""

from __future__ import annotations

import http.server
import json
import re
import shutil
import ssl
import threading
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta, timezone
from functools import partial
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from patience import wait_until
from playwright.sync_api import Browser, BrowserContext, Page, expect
from web_fixture import CHROMIUM, TIMEOUT_MS, Watched
from wificnc.simulator.serve.page import PageServer
from wificnc.simulator.serve.server import Server

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


def certificate(path: Path) -> Path:
    """Key and certificate of 127.0.0.1, signed by itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "127.0.0.1")])
    now = datetime.now(timezone.utc)
    built = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
    built = built.serial_number(1).not_valid_before(now - timedelta(days=1)).not_valid_after(now + timedelta(days=1))
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    path.write_bytes(key.private_bytes(*form) + built.sign(key, hashes.SHA256()).public_bytes(form[0]))
    return path


class Site:
    """A folder at https://127.0.0.1, and the paths that were asked for."""

    def __init__(self, folder: Path, pem: Path) -> None:
        self.folder, self.asked = folder, list[str]()

        class Handler(http.server.SimpleHTTPRequestHandler):
            def log_message(handler, *_: object) -> None:
                self.asked.append(handler.path)

        Handler.extensions_map = {**Handler.extensions_map, ".webmanifest": "application/manifest+json"}
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(pem)
        self.server.socket = context.wrap_socket(self.server.socket, server_side=True, do_handshake_on_connect=False)
        self.url = f"https://127.0.0.1:{self.server.server_port}/app/"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def site(built_page: Path, tmp_path: Path) -> Iterator[Site]:
    folder = tmp_path / "site"
    shutil.copytree(built_page, folder / "app", ignore=shutil.ignore_patterns("*.gz"))
    there = Site(folder, certificate(tmp_path / "key.pem"))
    yield there
    there.close()


@pytest.fixture
def context(trusting: Browser) -> Iterator[BrowserContext]:
    opened = trusting.new_context()
    opened.set_default_timeout(TIMEOUT_MS)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def trusting(browser: Browser) -> Iterator[Browser]:
    """Takes a certificate that signed itself, for service workers, too."""
    program = next(filter(None, map(shutil.which, CHROMIUM)))
    chromium = browser.browser_type.launch(
        executable_path=program, args=["--no-sandbox", "--ignore-certificate-errors"]
    )
    yield chromium
    chromium.close()


def opened(context: BrowserContext, url: str) -> Page:
    """The page, when all of it is kept."""
    page = context.new_page()
    page.goto(url)
    page.evaluate("() => navigator.serviceWorker.ready.then((there) => there.active.state)")
    return page


def first_words(context: BrowserContext, url: str) -> str:
    """Of the page in a window of its own. The last window of a version may be gone a little later than it closes."""
    page = context.new_page()
    page.goto(url)
    words = page.locator("meta[name=description]").get_attribute("content") or ""
    page.close()
    return words


def is_there(page: Page) -> None:
    expect(page.locator("header.top")).to_be_visible()


def test_it_starts_without_a_network(site: Site, context: BrowserContext) -> None:
    opened(context, site.url).close()
    site.close()
    page = context.new_page()
    page.goto(site.url)
    is_there(page)
    for tab in page.get_by_role("tab").all():
        tab.click()  # what is loaded later is kept, too
    is_there(page)


def test_the_manifest_is_one_for_installing(site: Site, context: BrowserContext) -> None:
    page = opened(context, site.url)
    said = context.new_cdp_session(page).send("Page.getAppManifest")
    assert said["errors"] == []
    manifest = json.loads(said["data"])
    assert manifest["display"] == "standalone" and said["url"] == f"{site.url}app.webmanifest"
    for icon in manifest["icons"]:
        assert (site.folder / "app" / icon["src"]).is_file()


def test_a_newer_version_comes_whole_and_with_the_next_start(site: Site, context: BrowserContext) -> None:
    """While a window has the older one, all of it stays the older one."""
    page = opened(context, site.url)
    index, worker = site.folder / "app" / "index.html", site.folder / "app" / "sw.js"
    index.write_text(index.read_text().replace("Install, set up", "Newer: install, set up"))
    worker.write_text(worker.read_text().replace('VERSION = "', 'VERSION = "newer-'))
    page.evaluate("() => navigator.serviceWorker.ready.then((there) => there.update())")
    page.wait_for_function("() => navigator.serviceWorker.ready.then((there) => there.waiting !== null)")
    page.reload()
    expect(page.locator("meta[name=description]")).to_have_attribute("content", re.compile("^Install"))
    page.close()
    wait_until(lambda: first_words(context, site.url).startswith("Newer"), "the newer version")
    page = opened(context, site.url)
    wait_until(lambda: len(page.evaluate("() => caches.keys()")) == 1, "only its files")
    assert page.evaluate("() => caches.keys()")[0].startswith("wificnc-newer-")


def test_firmware_next_to_it_is_never_an_old_one(site: Site, context: BrowserContext) -> None:
    (site.folder / "app" / "firmware").mkdir()
    file = site.folder / "app" / "firmware" / "index.json"
    page = opened(context, site.url)
    page.reload()
    for text in ("1", "2"):
        file.write_text(text)
        assert (
            page.evaluate("() => fetch('firmware/index.json', {cache: 'no-store'}).then((got) => got.text())") == text
        )


def test_on_http_nothing_is_kept(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    """A controller's address may be another controller's tomorrow."""
    _server, there = serve_page()
    page = watched().page(there.url)
    is_there(page)
    assert page.evaluate("() => navigator.serviceWorker.getRegistrations().then((all) => all.length)") == 0
