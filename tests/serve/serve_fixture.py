"""Controllers that serve, each test its own."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from patience import HANG_S
from serve_peer import Serve
from wificnc.board.load import load_board
from wificnc.simulator.serve.options import Address, Door, ServeOptions
from wificnc.simulator.serve.server import Server

# 250 steps/mm, 5000 mm/min, 500 mm/s2.
BASELINE = tuple(f"${base + ax}={value}" for base, value in ((100, 250), (110, 5000), (120, 500)) for ax in range(3))


def tell(servers: list[Server]) -> None:
    """What each has said of its clients, and whether it had ended by itself: pytest shows this where a test fails."""
    for process in (server._process for server in servers):
        ended = process.poll()
        print(f"server {process.pid}: {'still served' if ended is None else f'had ended with {ended}'}")
        with suppress(subprocess.TimeoutExpired, ValueError, OSError):  # ValueError: the test has stopped it
            print(process.communicate(timeout=HANG_S)[0])


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Serve]:
    """Start a controller of the host board at any free port, and with pty=True at `tmp_path / "tty"`."""
    servers: list[Server] = []
    with ExitStack() as stack:

        def start(
            speed: float = 0.0,
            pty: bool = False,
            variant: str = "release",
            control: int | None = None,
            board: str = "host",
            settings: tuple[str, ...] = (),
            key: str = "",
            store: Path | None = None,
            pendant: Door | None = None,
            pendant_kind: str = "terminal",
            wmc3: str | None = None,
        ) -> Server:
            the_board = load_board(board)
            if pendant and the_board.pendant:
                port = the_board.pendant.model_copy(update={"kind": pendant_kind})
                the_board = the_board.model_copy(update={"pendant": port})
            options = ServeOptions(
                board=the_board,
                pendant=pendant,
                tcp=Address("127.0.0.1", 0),
                pty=tmp_path / "tty" if pty else None,
                control=control,
                key=key,
                wmc3=wmc3,
                store=store,
                speed=speed,
                settings=(*BASELINE, *settings),
            )
            servers.append(stack.enter_context(Server(options, variant)))
            return servers[-1]

        yield start
        tell(servers)
    assert [server.stop() for server in servers] == [0] * len(servers), "a crash, or what a sanitizer found"
