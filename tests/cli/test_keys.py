"""Keys and passwords outside of the arguments, which other users of the computer can read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rich_click as click
from cli_parameters import parameters
from wificnc.app import root
from wificnc.board.load import load_board
from wificnc.commands._secret import Secret
from wificnc.connection.access import KEY_VARIABLE
from wificnc.firmware.nvs.image import read_image
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server

Cli = Callable[..., tuple[int, str, str]]
KEY = "correct horse battery"


def test_every_option_of_a_secret_can_be_asked_for() -> None:
    words = ("key", "password")
    found = {
        (name, option.opts[0]): option
        for name, option in parameters(root)
        if isinstance(option, click.Option) and not option.is_flag and option.opts[0].endswith(words)
    }
    assert len(found) > 6
    assert [where for where, option in found.items() if not isinstance(option.type, Secret)] == []


def test_a_dash_reads_it_from_stdin(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rich_click.prompt", lambda text, **_: {"access key": KEY, "wifi password": "pass word"}[text])
    file = tmp_path / "nvs.bin"
    words = ("--ssid", "shop", "--wifi-password", "-", "--access-key", "-")
    code, _, err = cli("nvs", "build", "baseline", "-o", file, *words)
    entries = read_image(file.read_bytes()).entries
    assert code == 0 and KEY not in err
    assert entries["wificnc", "access_key"].value == KEY and entries["wificnc", "wifi_pass"].value == "pass word"


@pytest.fixture
def locked() -> Iterator[str]:
    """The target of a controller that needs KEY."""
    with Server(ServeOptions(board=load_board("host"), tcp=Address("127.0.0.1", 0), key=KEY, speed=0.0)) as server:
        assert server.tcp
        yield server.tcp


def test_the_key_of_the_environment_logs_in(cli: Cli, locked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cli("settings", "get", "$0", "--to", locked)[0] == 1
    monkeypatch.setenv(KEY_VARIABLE, KEY)
    assert cli("settings", "get", "$0", "--to", locked)[0] == 0
    monkeypatch.setenv(KEY_VARIABLE, "of another controller")
    code, _, err = cli("settings", "get", "$0", "--to", locked)
    assert code == 1 and KEY_VARIABLE in err
    quoted = KEY.replace(" ", "%20")
    assert cli("settings", "get", "$0", "--to", f"tcp://:{quoted}@{locked.removeprefix('tcp://')}")[0] == 0
