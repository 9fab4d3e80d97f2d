"""`--settings` and `--set`: which files are refused, who may have one, and what a start makes of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from serve_peer import Peer
from wificnc.board.load import load_board
from wificnc.errors import ServeError
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.server import Server
from wificnc.tables.settings import load_settings
from wificnc_chips import ChipServer

CHIP = "pic32mz2048efh100"


def serve(store: Path, board: str = "host", settings: tuple[str, ...] = ()) -> Server | ChipServer:
    options = ServeOptions(
        board=load_board(board), tcp=Address("127.0.0.1", 0), store=store, settings=settings, speed=0.0
    )
    return Server(options) if board == "host" else ChipServer(options)


@pytest.mark.parametrize("board", ["host", CHIP])
@pytest.mark.parametrize(
    ("name", "words"),
    [(".", "is a folder"), ("no/such/kept", "folder not found"), ("fifo", "not an ordinary file")],
)
def test_what_cannot_be_a_settings_file_is_refused(tmp_path: Path, board: str, name: str, words: str) -> None:
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(ServeError, match=words), serve(tmp_path / name, board):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["fifo"]


@pytest.mark.parametrize(("first", "second"), [("host", "host"), ("host", CHIP), (CHIP, "host")])
def test_a_second_server_does_not_get_the_file(tmp_path: Path, first: str, second: str) -> None:
    store = tmp_path / "kept"
    with serve(store, first), pytest.raises(ServeError, match="in use by another server"), serve(store, second):
        pass
    store.unlink(missing_ok=True)
    with serve(store, second):
        pass


@pytest.mark.parametrize("stored", [True, False])
def test_a_machine_that_homes_starts_locked(tmp_path: Path, stored: bool) -> None:
    """Whether $22=1 was stored or is given at the start."""
    store = tmp_path / "kept"
    if stored:
        with serve(store) as server, Peer.tcp(server.tcp or "") as peer:
            assert peer.ask("$22=1") == ["ok"]
    with serve(store, settings=() if stored else ("$22=1",)) as server, Peer.tcp(server.tcp or "") as peer:
        assert peer.line().startswith("[MSG:Locked since start or reset")
        assert peer.ask("G0X1") == ["error:9"]
        assert peer.ask("$X")[-1] == "ok" and peer.ask("G0X1") == ["ok"]


def test_every_client_is_told_of_damage_when_it_connects(tmp_path: Path) -> None:
    store = tmp_path / "kept"
    with serve(store) as server, Peer.tcp(server.tcp or "") as peer:
        peer.ask("$100=80")
    image = bytearray(store.read_bytes())
    image[-10] ^= 1  # of the last setting
    store.write_bytes(image)
    last = load_settings().setting[-1].number
    told = f"[MSG:Stored data is damaged: settings ${last}. Check $$ $# $N, then $ACK]"
    with serve(store) as server:
        for _ in range(2):
            with Peer.tcp(server.tcp or "") as peer:
                assert peer.line() == told
                assert peer.ask("$X") == [told, "error:7"]
        with Peer.tcp(server.tcp or "") as peer:
            assert peer.line() == told
            assert peer.ask("$ACK")[-1] == "ok"
        with Peer.tcp(server.tcp or "") as peer:
            assert peer.line() == "[MSG:Locked since start or reset: '$H'|'$X' to unlock]"
            assert peer.ask("$X") == ["[MSG:Caution: Unlocked]", "ok"]
