"""How a controller is named: with a scheme, and as people type it."""

from __future__ import annotations

import json
import os
import pty
import re
import tty
from pathlib import Path

import pytest
from click.testing import CliRunner
from core_bridge import Bridge
from patience import HANG_S
from wificnc.app import root
from wificnc.build.checkout import checkout_root
from wificnc.connection.port import BOARD_PORT, SERVE_PORT
from wificnc.connection.target import NetworkTarget, SerialTarget, host_and_port, is_target, parse_target
from wificnc.connection.transport import open_transport
from wificnc.errors import Exit, LinkError, UserError
from wificnc.firmware.flash.ota import PORT as OTA_PORT

NETWORK = [
    ("127.0.0.1:2323", "127.0.0.1", 2323),
    ("tcp://127.0.0.1:2323", "127.0.0.1", 2323),
    ("192.168.1.5", "192.168.1.5", BOARD_PORT),
    ("tcp://192.168.1.5", "192.168.1.5", BOARD_PORT),
    ("wificnc-1a2b.local:23", "wificnc-1a2b.local", 23),
    ("wificnc-1a2b.local", "wificnc-1a2b.local", BOARD_PORT),
    ("localhost", "localhost", SERVE_PORT),
    ("mill:23", "mill", 23),
    ("127.0.0.61", "127.0.0.61", SERVE_PORT),
    ("tcp://mill", "mill", BOARD_PORT),
    ("[::1]:2323", "::1", 2323),
    ("[::1]", "::1", SERVE_PORT),
    ("[fe80::1]", "fe80::1", BOARD_PORT),
    ("[fe80::1%eth0]", "fe80::1%eth0", BOARD_PORT),
    ("tcp://[fe80::1]:23", "fe80::1", 23),
    (" 127.0.0.1:23 ", "127.0.0.1", 23),
    ("TCP://127.0.0.1:23", "127.0.0.1", 23),
]
SERIAL = [
    ("/dev/ttyUSB0", "/dev/ttyUSB0", 115200),
    ("serial:///dev/ttyUSB0", "/dev/ttyUSB0", 115200),
    ("/dev/ttyUSB0?baud=250000", "/dev/ttyUSB0", 250000),
    ("serial:///dev/ttyUSB0?baud=250000", "/dev/ttyUSB0", 250000),
    ("/dev/cu.usbserial-0001", "/dev/cu.usbserial-0001", 115200),
    ("/dev/serial/by-id/usb-1a86_USB:2.0-if00", "/dev/serial/by-id/usb-1a86_USB:2.0-if00", 115200),
    ("./cnc", "./cnc", 115200),
    ("../cnc", "../cnc", 115200),
    ("COM3", "COM3", 115200),
    ("com12?baud=57600", "com12", 57600),
    ("serial://COM5", "COM5", 115200),
    (r"\\.\COM12", r"\\.\COM12", 115200),
]
WRONG = [
    "", " ", "::1", "fe80::1:2323", "ttyUSB0", "ttyACM0?baud=9600", "cnc", "COM", "COM3:2323", "192.168.1",
    "192.168.1.300", "192.168.1.5:", "192.168.1.5:0", "192.168.1.5:65536", "192.168.1.5:http",
    "192.168.1.5:-1", "[::1", "[::1]2323", "[cnc]:23", "udp://127.0.0.1", "http://127.0.0.1:2323", "tcp://",
    "tcp://:2323", "serial://", "192.168.1.5:23/x", "192.168.1.5?baud=9600", "/dev/ttyUSB0?baud=fast",
    "/dev/ttyUSB0?baud=0", "/dev/ttyUSB0?speed=9600", "two words", "a b:23", "tcp://mill:23:24",
]  # fmt: skip


@pytest.mark.parametrize(("text", "host", "port"), NETWORK)
def test_network(text: str, host: str, port: int) -> None:
    assert parse_target(text) == NetworkTarget(host, port)


@pytest.mark.parametrize("text", [":se%40cret@192.168.1.5:23", "tcp://:se%40cret@192.168.1.5:23"])
def test_network_with_a_password(text: str) -> None:
    assert parse_target(text) == NetworkTarget("192.168.1.5", 23, "se@cret")


@pytest.mark.parametrize(("text", "path", "baud"), SERIAL)
def test_serial(text: str, path: str, baud: int) -> None:
    assert parse_target(text) == SerialTarget(path, baud)


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_or_ambiguous_says_how_to_write_it(text: str) -> None:
    with pytest.raises(UserError) as caught:
        parse_target(text)
    assert caught.value.hint and repr(text.strip()) in caught.value.message


@pytest.mark.parametrize(
    ("text", "ways"),
    [
        ("cnc", ["cnc.local", "cnc:23", "./cnc"]),
        ("ttyUSB0", ["/dev/ttyUSB0"]),
        ("::1", ["[::1]:2323"]),
        ("fe80::1", ["[fe80::1]:23"]),
    ],
)
def test_the_hint_has_what_would_be_right(text: str, ways: list[str]) -> None:
    with pytest.raises(UserError) as caught:
        parse_target(text)
    for way in ways:
        assert way in (caught.value.hint or "")
        parse_target(way)


@pytest.mark.parametrize("text", [row[0] for row in [*NETWORK, *SERIAL] if "/cnc" not in row[0]])
def test_a_side_of_a_comparison(text: str) -> None:
    """A name without a port may be a file."""
    assert is_target(text) == (text not in ("wificnc-1a2b.local", "localhost"))


@pytest.mark.parametrize("text", ["settings.toml", "old", "./old.toml", "/mnt/old.toml", "controller", "a/b:c"])
def test_a_file_is_no_target(text: str) -> None:
    assert not is_target(text)


def test_the_default_port_of_a_host_is_the_callers() -> None:
    assert host_and_port("192.168.1.5", 58430) == ("192.168.1.5", 58430)
    assert host_and_port("[::1]:5", 58430) == ("::1", 5)
    with pytest.raises(UserError):
        host_and_port("192.168.1.5:x", 58430)


def status_of(target: str) -> dict[str, object]:
    result = CliRunner().invoke(root, ["status", "--to", target, "--json"])
    assert result.exit_code == 0, result.exception
    document: dict[str, object] = json.loads(result.stdout)
    return document


@pytest.mark.parametrize("write", ["127.0.0.1:{}", "localhost:{}", "tcp://127.0.0.1:{}"])
def test_a_command_without_a_scheme(write: str) -> None:
    with Bridge() as bridge:
        target = write.format(bridge.target.rpartition(":")[2])
        assert status_of(target)["state"] == "Idle"


def test_settings_diff_without_a_scheme(tmp_path: Path) -> None:
    with Bridge() as bridge:
        address, file = bridge.target.removeprefix("tcp://"), tmp_path / "now.toml"
        for words in (["export", str(file), "--to", address], ["diff", str(file), address]):
            result = CliRunner().invoke(root, ["settings", *words])
            assert result.exit_code == 0, (words, result.output, result.exception)


def test_a_device_without_a_scheme() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    transport = open_transport(os.ttyname(slave))
    os.write(master, b"ok\r\n")
    transport.wait(HANG_S)
    assert transport.receive()
    transport.close()
    os.close(slave)
    os.close(master)


def test_the_login_of_a_start_page_asks_at_the_port_of_a_board() -> None:
    """It asked at that of `wificnc serve`, which no board opens."""
    page = (checkout_root() / "docs/start/esp32.md").read_text(encoding="utf-8")
    found = re.search(r"^wificnc login (\S+)", page, re.MULTILINE)
    assert found and parse_target(found[1]) == NetworkTarget("192.168.1.20", BOARD_PORT)


def test_a_closed_default_port_leads_to_that_of_serve(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise ConnectionRefusedError(111, "Connection refused")

    monkeypatch.setattr("socket.create_connection", refuse)
    with pytest.raises(LinkError) as caught:
        open_transport("192.168.1.5")
    assert "192.168.1.5:2323" in (caught.value.hint or "")
    with pytest.raises(LinkError) as caught:
        open_transport("127.0.0.1")
    assert "127.0.0.1:" not in (caught.value.hint or "") and "wificnc serve" in (caught.value.hint or "")


@pytest.mark.parametrize("text", ["127.0.0.1:2323", "tcp://127.0.0.1", "/dev/ttyUSB0", "COM3", ""])
@pytest.mark.parametrize("words", [["wmc3", "handshake"], ["linuxcnc", "init", "shapeoko3"]])
def test_the_binary_protocol_takes_an_address_alone(words: list[str], text: str) -> None:
    with pytest.raises(UserError, match="IPv4") as caught:
        CliRunner().invoke(root, [*words, "--to", text], catch_exceptions=False)
    assert caught.value.exit_code == Exit.USAGE


def test_an_update_over_the_network_refuses_a_wrong_port() -> None:
    """It was a traceback."""
    with pytest.raises(UserError, match="a TCP port is 1 to"):
        host_and_port("192.168.1.5:70000", OTA_PORT)
