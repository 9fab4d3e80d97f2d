"""The PC's store with the power cut at every call that replaces its file, for every command that stores: old or new."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from grbl_host import Grbl
from patience import HANG_S
from slow import slow_but
from wificnc.build.checkout import checkout_root

BEFORE = ("$100=640", "$110=1234.5", "G10L2P3X1.5Y-2", "G10L2P9Z4", "G10L1P5Z-3R2(flat)", "$N0=G21", "$N1=G90")
BEFORE += ("$I=SHOP",)
COMMANDS = ("$100=77", "G10L2P1X5", "G10L2P8Y6", "G10L20P2X1Z2", "G10L1P7Z1R3(ball)", "G28.1", "G30.1")
COMMANDS += ("$N0=G20", "$N1=", "$I=MILL", "$RST=$", "$RST=#", "$RST=*")
KEPT = ("$100=77", "G10L2P1X5", "$N0=G20", "$RST=*")  # one of each part of the store, and all of them
QUESTIONS = "$$\n$#\n$N\n$I\nG43H5\n$#\nG43H7\n$#\n"
CALLS = 7  # open, write, flush, sync, close, rename, and after it
SYNC = 4
CUT = 75

# One controller in its own process: it is the process that the power leaves.
CHILD = """
import sys
from pathlib import Path
from grbl_host import Grbl
controller = Grbl(store=Path(sys.argv[1]))
controller.send("$X\\nG91G1X0.5Y0.2F5000\\n")
print(controller.send(sys.argv[2] + "\\n"))
"""


@pytest.fixture(scope="module")
def shim() -> Path:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if sys.platform != "linux" or compiler is None:
        pytest.skip("LD_PRELOAD and a C compiler are needed")
    library = checkout_root() / "build" / "tests" / "settings" / "cut_shim.so"
    library.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [compiler, "-shared", "-fPIC", "-O1", Path(__file__).with_name("cut_shim.c"), "-o", library, "-ldl"], check=True
    )
    return library


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    store = tmp_path_factory.mktemp("before") / "kept"
    controller = Grbl(store=store)
    for line in BEFORE:
        assert "error" not in controller.send(line + "\n")
    controller.close()
    return store.read_bytes()


def run(shim: Path, store: Path, command: str, **cut: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **cut, "LD_PRELOAD": str(shim), "PYTHONPATH": os.pathsep.join(sys.path)}  # noqa: TID251
    arguments = [sys.executable, "-c", CHILD, str(store), command]
    return subprocess.run(arguments, capture_output=True, text=True, env=environment, timeout=HANG_S, check=False)


def shown(store: Path) -> str:
    controller = Grbl(store=store)
    said = controller.send("")
    assert "damaged" not in said, said
    text = controller.send("$X\n" + QUESTIONS)
    controller.close()
    return text


@pytest.mark.alike(2)
@pytest.mark.parametrize("command", slow_but("$100=77".__eq__, COMMANDS, KEPT.__contains__))
def test_old_or_new(shim: Path, tmp_path: Path, before: bytes, command: str) -> None:
    store, log = tmp_path / "kept", tmp_path / "calls"
    store.write_bytes(before)
    old = shown(store)
    done = run(shim, store, command, CUT_LOG=str(log))
    assert done.returncode == 0 and "ok" in done.stdout, done.stderr
    new = shown(store)
    assert new != old and int(log.read_text()) == CALLS, "the file is replaced once: all of it or nothing"
    for nth in range(1, CALLS + 1):
        for half in ({}, {"CUT_HALF": "1"}) if nth == SYNC else ({},):
            store.write_bytes(before)
            assert run(shim, store, command, CUT_AT=str(nth), **half).returncode == CUT
            assert shown(store) == (new if nth == CALLS else old), f"call {nth}"
