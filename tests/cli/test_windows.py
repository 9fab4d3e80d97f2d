"""What Windows lacks is not asked for there. Windows itself is not here: modules that it does not have are blocked."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from pathlib import Path

import pytest
from patience import HANG_S, wait_until
from wificnc.build.checkout import checkout_root
from wificnc.build.objects import put_in_place
from wificnc.console import ConsoleKeys

PACKAGE = checkout_root() / "cli" / "wificnc"

# The standard library and other packages find this system; for ours it is Windows from then on.
IMPORT_ALL = """
import importlib, pkgutil, sys, types
import asyncio, ctypes, esptool, getpass, http.server, importlib.metadata, jinja2, matplotlib, multiprocessing, numpy
import pathlib, platform, pydantic, rich.live, rich.markup, rich.progress, rich.table, rich_click, segno, selectors
import serial.tools.list_ports, shutil, socketserver, subprocess, tempfile, venv, webbrowser, zipfile
import matplotlib.figure, matplotlib.backends.backend_agg
import esp_idf_nvs_partition_gen.nvs_partition_gen
sys.modules.update(dict.fromkeys(["fcntl", "termios", "pty", "tty", "grp", "pwd", "resource"]))
msvcrt = types.ModuleType("msvcrt")
msvcrt.LK_LOCK, msvcrt.LK_NBLCK = 1, 2
sys.modules["msvcrt"] = msvcrt
sys.platform = "win32"
import wificnc, wificnc_chips
packages = (wificnc, wificnc_chips)
rows = [row for package in packages for row in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
names = [row.name for row in rows if not row.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""


def test_every_module_can_be_imported_on_windows() -> None:
    run = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, timeout=HANG_S, check=False, cwd=PACKAGE
    )
    assert run.returncode == 0, run.stderr
    assert int(run.stdout) > 100


def test_keys_of_a_console_end_a_wait() -> None:
    typed = iter("a!")
    with ConsoleKeys(lambda: next(typed, "")) as keys:
        heard: list[str] = []

        def has_all() -> bool:
            select.select([keys.fileno()], [], [], HANG_S)
            heard.append(keys.read())
            return "".join(heard) == "a!"

        wait_until(has_all, lambda: heard)


def test_a_loaded_library_is_renamed_where_it_cannot_be_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, fresh = tmp_path / "a.dll", tmp_path / "new"
    output.write_bytes(b"old")
    replace = os.replace

    def windows_replace(source: Path, target: Path) -> None:
        if Path(target) == output and output.exists():
            raise PermissionError("loaded")
        replace(source, target)

    monkeypatch.setattr(os, "replace", windows_replace)
    for content in (b"one", b"two"):
        fresh.write_bytes(content)
        put_in_place(fresh, output)
        assert output.read_bytes() == content
    assert len(list(tmp_path.iterdir())) == 2  # the second one removes what the first one left
