"""`wificnc serve` as a person runs it: what it says, how it ends, and how it explains what cannot be."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from patience import HANG_S
from serve_peer import Peer
from signals import ignored_signals, usual_signals
from wificnc.errors import Exit, UserError
from wificnc.simulator.serve.options import Address, parse_address, parse_speed

ROOT = Path(__file__).resolve().parents[2]


@contextmanager
def serving(*words: str, nohup: bool = False) -> Iterator[subprocess.Popen[str]]:
    argv = [sys.executable, "-m", "wificnc", "serve", "--tcp", "127.0.0.1:0", *words]
    pipe = subprocess.PIPE
    with ignored_signals() if nohup else usual_signals():
        process = subprocess.Popen(argv, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def address_of(process: subprocess.Popen[str]) -> str:
    assert process.stdout
    word, _, address = process.stdout.readline().strip().partition(" ")
    assert word == "tcp"
    return address.strip()


def refused(*words: str) -> tuple[int, str]:
    run = subprocess.run(
        [sys.executable, "-m", "wificnc", "serve", *words], capture_output=True, text=True, timeout=HANG_S
    )
    return run.returncode, run.stderr


@pytest.mark.parametrize("key", ["-- --", "a" * 64])
def test_a_key_that_no_one_can_prove_is_refused(key: str) -> None:
    code, said = refused("--key", key)
    assert code == Exit.USAGE and "--key needs 1 to 63 letters and digits" in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_when_asked(tmp_path: Path, number: int) -> None:
    link = tmp_path / "tty"
    with serving("--pty", str(link)) as process:
        with Peer.tcp(address_of(process)) as peer:
            assert peer.ask("G0X1") == ["ok"]
            assert link.is_symlink()
            process.send_signal(number)
            peer.until_closed()
        assert process.wait(HANG_S) == 0
        assert not link.is_symlink()


def test_in_the_background_it_outlives_its_terminal() -> None:
    """Ctrl-C and the end of the terminal reach the whole group; who starts it by nohup wants neither to end it."""
    with serving(nohup=True) as process:
        with Peer.tcp(address_of(process)) as peer:
            for number in (signal.SIGINT, signal.SIGHUP):
                os.killpg(process.pid, number)
                assert peer.ask("G0X1") == ["ok"]
            process.send_signal(signal.SIGTERM)
            peer.until_closed()
        assert process.wait(HANG_S) == 0


def test_the_page_is_served_beside_the_stream(tmp_path: Path) -> None:
    page = ROOT / "web" / "dist" / "index.html"
    if not page.is_file():
        pytest.skip("the page is not built: make web")
    with serving("--http", "127.0.0.1:0") as process:
        assert process.stdout
        word, _, url = process.stdout.readline().strip().partition(" ")
        assert word == "page"
        with urllib.request.urlopen(f"{url.strip()}api/controller", timeout=HANG_S) as answer:
            assert json.load(answer)["axes"] == 6
        with urllib.request.urlopen(url.strip(), timeout=HANG_S) as answer:
            assert answer.read() == page.read_bytes()
        with Peer.tcp(address_of(process)) as peer:
            assert peer.ask("G0X1") == ["ok"]
        process.send_signal(signal.SIGINT)
        assert process.wait(HANG_S) == 0


def test_controller_ends_with_the_command_that_started_it(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with serving("--pty", str(link)) as process, Peer.tcp(address_of(process)) as peer:
        assert peer.ask("G0X1") == ["ok"]
        process.kill()
        peer.until_closed()
        assert not link.is_symlink()


def test_port_in_use() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        code, said = refused("--tcp", f"127.0.0.1:{other.getsockname()[1]}")
    assert code == 4
    assert "is in use" in said
    assert "--tcp 127.0.0.1:0 takes any free port" in said


@pytest.mark.parametrize("kind", ["file", "empty file", "folder", "link to a file", "link to nothing", "link to USB"])
def test_what_is_there_is_not_replaced(tmp_path: Path, kind: str) -> None:
    """Nor does anything say that it should be deleted: it is someone's."""
    name, target = tmp_path / "ok.nc", tmp_path / "target"
    if kind == "folder":
        name.mkdir()
    elif kind.startswith("link"):
        name.symlink_to("/dev/ttyUSB99" if kind == "link to USB" else target)
        if kind == "link to a file":
            target.write_text("mine")
    else:
        name.write_text("mine" if kind == "file" else "")

    def look() -> tuple[object, ...]:
        return name.is_symlink(), name.is_dir(), name.read_text() if name.is_file() else None

    before = look()
    code, said = refused("--tcp", "off", "--pty", str(name))
    assert code == 4
    assert "the name already exists and is not replaced" in said
    assert "choose a new name" in said and "rm " not in said
    assert look() == before


def test_link_left_over_from_a_crash_is_replaced(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    link.symlink_to("/dev/pts/999999")
    with serving("--pty", str(link)) as process:
        address_of(process)
        assert os.readlink(link) != "/dev/pts/999999"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--http", "127.0.0.1:nowhere"), "--http '127.0.0.1:nowhere' is not an address"),
        (("--tcp", "off"), "no port is configured"),
        (("--speed", "fast"), "--speed 'fast' is not a speed"),
        (("--tcp", "here:port"), "--tcp 'here:port' is not an address"),
        (("--tcp", "127.0.0.1:0", "--set", "$333=1"), "the controller refuses $333=1: error:3"),
        (("--pty", "/nowhere/at/all", "--tcp", "off"), "No such file or directory"),
    ],
)
def test_what_cannot_be_is_explained(words: tuple[str, ...], message: str) -> None:
    code, said = refused(*words)
    assert code in (2, 4)
    assert message in said.replace("\n", " ")
    assert "Traceback" not in said


def test_a_profile_does_not_undo_what_the_file_keeps(tmp_path: Path) -> None:
    """The profile is for a new file: what a machinist has calibrated since then stays."""
    words = ("--settings", str(tmp_path / "settings.bin"), "--machine", "shapeoko3", "--speed", "max")
    with serving(*words) as process, Peer.tcp(address_of(process)) as peer:
        assert peer.ask("$100=50") == peer.ask("$110=4321") == ["ok"]
    with serving(*words) as process, Peer.tcp(address_of(process)) as peer:
        assert {"$100=50.000", "$110=4321.000", "$120=400.000"} <= set(peer.ask("$$"))


def test_settings_are_kept_in_a_file(tmp_path: Path) -> None:
    store = str(tmp_path / "settings.bin")
    for kept in (None, 1234, 77):
        with serving("--settings", store, "--speed", "max") as process, Peer.tcp(address_of(process)) as peer:
            assert (f"$110={kept}.000" in peer.ask("$$")) == (kept is not None)
            assert peer.ask(f"$110={1234 if kept is None else 77}") == ["ok"]


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1:2323", Address("127.0.0.1", 2323)),
        ("localhost", Address("localhost", 2323)),
        (":0", Address("127.0.0.1", 0)),
        ("[::1]:99", Address("::1", 99)),
        ("off", None),
    ],
)
def test_addresses(text: str, address: Address | None) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["", "a:b", "1.2.3.4:70000", "::1:5", "[::1"])
def test_no_addresses(text: str) -> None:
    with pytest.raises(UserError):
        parse_address(text)


def test_speeds() -> None:
    assert [parse_speed(text) for text in ("1", "0.5", "max")] == [1.0, 0.5, 0.0]
    for text in ("0", "-1", "nan", "inf", "1e9", "x"):
        with pytest.raises(UserError):
            parse_speed(text)
