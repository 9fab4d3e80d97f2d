"""Each test has one ring, decided in one place; a test of core is refused what can make it fail on a busy computer."""

from __future__ import annotations

import os
import queue
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from core_only import PROGRAMS, RefusedError, allow_again
from rings import EXCEPTIONS, FOLDERS, ROOT, TESTS, NoRingError, Ring, files_of_tests, name_of, ring_of, ring_of_case
from stories import NO_BROWSER, STORIES
from tools_here import needs_git

TICK_S = 0.01


def test_each_folder_of_tests_has_one_ring() -> None:
    folders = {name_of(path).partition("/")[0] for path in files_of_tests()}
    named = [folder for ring in Ring for folder in FOLDERS[ring]]
    assert sorted(named) == sorted(folders)


def test_a_file_that_is_named_nowhere_is_an_error() -> None:
    with pytest.raises(NoRingError, match=r"new/test_new\.py: in which ring are its tests"):
        ring_of(TESTS / "new" / "test_new.py")


def test_the_emulators_tests_have_rings_too() -> None:
    assert ring_of(ROOT / "emulators" / "tests" / "espsim" / "test_espsim_cpu.py") is Ring.CHIPS
    with pytest.raises(NoRingError, match="tests are in tests or emulators/tests"):
        ring_of(ROOT / "cli" / "test_it.py")


def test_each_exception_is_one() -> None:
    """Of a test that exists, once, and not where its folder or file is anyway."""
    names = [name for ring in Ring for name in EXCEPTIONS[ring]]
    assert len(names) == len(set(names))
    for ring in Ring:
        for name in EXCEPTIONS[ring]:
            file, _, test = name.partition("::")
            assert not test or re.search(rf"^def {test}\b", (TESTS / file).read_text(encoding="utf-8"), re.MULTILINE), (
                name
            )
            assert ring_of(TESTS / file, test) is ring
            folder = next(ring for ring in Ring if file.partition("/")[0] in FOLDERS[ring])
            assert (ring_of(TESTS / file) if test else folder) is not ring, f"{name} is in {ring.value} without that"


def test_a_test_is_looked_up_before_its_file_and_folder() -> None:
    assert ring_of(TESTS / "linuxcnc" / "test_linuxcnc_halrun.py") is Ring.REALTIME
    doctor = TESTS / "link" / "test_doctor.py"
    test = "test_the_command_prints_json_for_scripts"
    assert (ring_of(doctor, "test_other"), ring_of(doctor, test)) == (Ring.CORE, Ring.REALTIME)


@pytest.mark.parametrize(
    ("takes", "parameters", "ring"),
    [
        ((), {}, Ring.CORE),
        (("tmp_path", "settings"), {"n": 1}, Ring.CORE),
        (("bridge", "client"), {}, Ring.REALTIME),
        (("board", "build", "image"), {}, Ring.CHIPS),
        (("grbl",), {"grbl": "chip"}, Ring.CHIPS),
        (("grbl",), {"grbl": "host"}, Ring.CORE),
    ],
)
def test_what_a_case_takes_decides_next(takes: tuple[str, ...], parameters: dict[str, object], ring: Ring) -> None:
    called = SimpleNamespace(params=parameters)
    item: Any = SimpleNamespace(path=TESTS / "grbl" / "test_x.py", name="test_x", fixturenames=takes, callspec=called)
    assert ring_of_case(item) is ring


def wait_for_a_lock() -> None:
    lock = threading.Condition()
    with lock:
        lock.wait(TICK_S)


@pytest.mark.parametrize(
    ("does", "ring"),
    [
        (lambda: time.sleep(TICK_S), "realtime"),
        (lambda: threading.Event().wait(TICK_S), "realtime"),
        (lambda: queue.Queue().get(timeout=TICK_S), "realtime"),
        (wait_for_a_lock, "realtime"),
        (socket.socket, "realtime"),
        (lambda: socket.create_connection(("127.0.0.1", 9)), "realtime"),
        (lambda: subprocess.run([sys.executable, "-c", "pass"]), "chips"),
        (lambda: subprocess.Popen(["no-such-program"]), "chips"),
        (lambda: os.system("true"), "chips"),
        pytest.param(lambda: os.fork(), "chips", marks=pytest.mark.skipif(os.name == "nt", reason="has no fork")),
    ],
)
def test_what_waits_is_refused_with_the_right_ring(does: Callable[[], object], ring: str) -> None:
    with pytest.raises(RefusedError, match=rf"test_rings.*belongs to the ring {ring}"):
        does()


@needs_git
def test_what_needs_no_clock_is_allowed() -> None:
    """Threads that end, locks that are free, and the programs of the list."""
    thread = threading.Thread(target=lambda: time.sleep(0))  # in no test's own thread
    thread.start()
    thread.join()
    with ThreadPoolExecutor(2) as pool:  # asks for a free thread, and does not wait for one
        assert list(pool.map(abs, (-1, -2))) == [1, 2]
    assert subprocess.run(["git", "--version"], capture_output=True, check=True).stdout.startswith(b"git")


def test_what_the_whole_session_shares_may_end() -> None:
    """Behind the last test of a worker: a browser of another ring, say."""
    allow_again()
    time.sleep(0)


def test_each_program_has_a_reason() -> None:
    assert all(re.fullmatch(r"\w[^.]{10,}", reason) for reason in PROGRAMS.values())


def test_the_document_has_the_three_rings_in_one_table() -> None:
    text = (Path(TESTS).parent / "docs" / "development.md").read_text(encoding="utf-8")
    assert [name for name in re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE) if name in {r.value for r in Ring}] == [
        ring.value for ring in Ring
    ]


def test_each_file_with_a_browser_has_a_story_and_each_story_is_a_test() -> None:
    files = {path.name for path in (TESTS / "web").glob("test_*.py")}
    assert {*STORIES, *NO_BROWSER} == files
    for file, names in STORIES.items():
        text = (TESTS / "web" / file).read_text(encoding="utf-8")
        assert [name for name in names if f"\ndef test_{name}(" not in text] == [], file
    assert 40 <= sum(map(len, STORIES.values())) <= 80
