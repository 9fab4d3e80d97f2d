"""The component's loop over real sockets: the first connection, and the next one."""

from __future__ import annotations

import argparse
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest
from link_bench import FakeHal
from wificnc.board.load import load_board
from wificnc.linuxcnc import component, link
from wificnc.linuxcnc.pins import Pins
from wificnc.serve.options import ServeOptions
from wificnc.serve.server import Server

ADDRESS = f"127.64.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"  # the ports are fixed
ASKED = argparse.Namespace(address=ADDRESS, password="", queue_ms=100.0, run_up_s=0.0)


class StoppablePins(Pins):
    """Who reads a pin when it is to end, ends."""

    ends = False

    def __getitem__(self, name: str) -> Any:
        if self.ends and threading.current_thread() is not threading.main_thread():
            raise KeyboardInterrupt
        return super().__getitem__(name)

    def __setitem__(self, name: str, value: Any) -> None:
        if self.ends:
            raise KeyboardInterrupt
        super().__setitem__(name, value)


def wait_for(condition: Callable[[], Any], what: str) -> None:
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def serve() -> Server:
    return Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS))


def test_a_controller_that_goes_and_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(component, "RETRY_S", 0.1)
    monkeypatch.setattr(link, "SILENT_S", 0.4)
    pins = StoppablePins(FakeHal, "wificnc", 3)

    def run() -> None:
        with suppress(KeyboardInterrupt):
            component.run(pins, ASKED)

    thread = threading.Thread(target=run)
    with serve():
        thread.start()
        wait_for(lambda: pins.component.is_ready, "LinuxCNC goes on")
        assert pins["connected"] and pins["estop-ok"], "not before the controller is known"
        pins["enable"] = True
        wait_for(lambda: pins["queue-ms"] > 0, "it has motion")
    wait_for(lambda: not pins["connected"], "the link is lost")
    wait_for(lambda: pins["fault"], "motion has ended by itself")
    assert not pins["estop-ok"] and not pins["ready"]
    pins["enable"] = False
    with serve():
        wait_for(lambda: pins["connected"] and pins["estop-ok"], "it is there again")
        assert pins["fault"] and not pins["ready"], "until somebody says so"
        pins["reset"] = True
        wait_for(lambda: pins["ready"], "reset")
        pins["enable"] = True
        wait_for(lambda: pins["queue-ms"] > 0, "and goes on")
    pins.ends = True
    thread.join(10)
    assert not thread.is_alive()


def test_linuxcnc_does_not_wait_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(component, "RETRY_S", 0.05)
    monkeypatch.setattr(component, "FIRST_S", 0.1)
    pins = StoppablePins(FakeHal, "wificnc", 3)

    def run() -> None:
        with suppress(KeyboardInterrupt):
            component.run(pins, argparse.Namespace(**{**vars(ASKED), "address": "127.65.1.1"}))

    thread = threading.Thread(target=run)
    thread.start()
    wait_for(lambda: pins.component.is_ready, "it goes on without a controller")
    assert not pins["connected"] and not pins["estop-ok"]
    pins.ends = True
    thread.join(10)
    assert not thread.is_alive()
