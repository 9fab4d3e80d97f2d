"""A terminal without UTF-8: nothing is reported that stops the command, and JSON loses nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from patience import HANG_S
from slow import deep_but

LOCALES = {
    "C": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "ascii": {"LC_ALL": "C.UTF-8", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    "latin-1": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "latin-1"},
}
COMMANDS = {
    "help": ("--help",),
    "sim": ("sim", "{job}"),
    "sim a bad line": ("sim", "{bad}"),
    "check": ("check", "{bad}", "--machine", "baseline"),
    "doctor": ("doctor",),
    "boards list": ("boards", "list"),
    "boards show": ("boards", "show", "esp32-wroom32"),
    "boards show pic32mz": ("boards", "show", "pic32mz-zig"),
    "boards check": ("boards", "check"),
    "dev pins": ("dev", "pins", "esp32-wroom32"),
    "expand": ("expand", "{job}", "-o", "-"),
    "missing": ("sim", "{missing}"),
    "linuxcnc component": ("linuxcnc", "component", "--out", "-"),
}


def run(locale: str, *words: str) -> subprocess.CompletedProcess[bytes]:
    environment = {**os.environ, **LOCALES[locale]}
    environment.pop("LANG", None)
    return subprocess.run(
        [sys.executable, "-m", "wificnc", *words], capture_output=True, env=environment, timeout=HANG_S
    )


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    job, bad = tmp_path / "job.nc", tmp_path / "b\u00f6se.nc"
    job.write_text("(Stra\u00dfe \u00b5)\nG0X1\n", encoding="utf-8")
    bad.write_text("G0X1 (\u00c4)\nG1X2 (no F, gr\u00fc\u00dfe)\n", encoding="utf-8")
    return {"job": str(job), "bad": str(bad), "missing": str(tmp_path / "f\u00e9hlt.nc")}


@pytest.mark.parametrize("locale", deep_but("C".__eq__, LOCALES))
@pytest.mark.parametrize("case", COMMANDS)
def test_no_traceback(files: dict[str, str], case: str, locale: str) -> None:
    done = run(locale, *(word.format(**files) for word in COMMANDS[case]))
    assert b"Traceback" not in done.stderr, done.stderr.decode(errors="replace")[-800:]
    assert done.returncode in (0, 1, 2, 3)
    if locale != "latin-1":
        done.stdout.decode("utf-8" if "component" in case or case == "pins" else "ascii")


def test_what_is_ours_is_written_in_ascii(files: dict[str, str]) -> None:
    assert b"max mm/s2" in run("C", "sim", files["job"]).stdout


@pytest.mark.parametrize("locale", LOCALES)
def test_json_loses_nothing(files: dict[str, str], locale: str) -> None:
    done = run(locale, "sim", files["bad"], "--json", "-")
    report = json.loads(done.stdout.decode("latin-1" if locale == "latin-1" else "ascii"))
    assert report["errors"][0]["text"] == "G1X2 (no F, gr\u00fc\u00dfe)"
