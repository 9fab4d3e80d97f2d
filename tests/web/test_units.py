"""The page's own unit tests, and its generated tables."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from generate.page_tables import board_tables
from wificnc.board.header import pin_header_text
from wificnc.board.load import find_boards, load_board
from wificnc.build.checkout import checkout_root
from wificnc.profile.load import find_machines, load_machine

from web.build import install_packages, missing_tools, run_npm

ESP32_BOARDS = [path.stem for path in find_boards() if load_board(path).target == "esp32"]


# What no profile that comes with WiFiCNC has.
GANTRY = """
schema = 1
name = "Gantry, and a turning axis with a switch"
axis.x = { steps_per_mm = 53.333333, max_rate_mm_min = 5000, acceleration_mm_s2 = 400.5, home_at = "min" }
axis.a = { steps_per_deg = 0.0123456, max_rate_deg_min = 5000, acceleration_deg_s2 = 400, home_at = "max" }
kinematics.type = "cartesian"
homing = { enabled = true, order = ["X", "YA"] }
limits.hard = true
stepper = { step_pulse_us = 4, enable_active_high = true }

[axis.y]
steps_per_mm = 40
max_rate_mm_min = 5000
acceleration_mm_s2 = 400
invert_step = true
second = { driver = "b", own_switch = false, invert_direction = true, pull_off_mm = 2 }
"""


def write_gantry(folder: Path) -> Path:
    path = folder / "gantry.toml"
    path.write_text(GANTRY)
    return path


def profile_row(path: Path) -> dict[str, object]:
    """A profile, and the settings that the command line makes of it."""
    values = load_machine(path).settings_texts()
    return {"name": path.stem, "text": path.read_text(), "values": {str(n): text for n, text in values.items()}}


def test_units(tmp_path: Path) -> None:
    if why := missing_tools():
        pytest.skip(why)
    install_packages(checkout_root())
    oracle = tmp_path / "profiles.json"
    oracle.write_text(json.dumps([profile_row(path) for path in (*find_machines().values(), write_gantry(tmp_path))]))
    said = run_npm(checkout_root(), "test", "--", "--reporter=json", WIFICNC_PROFILES=str(oracle))
    result = json.loads(said[said.index("{") :])
    assert result["success"]
    assert result["numPassedTests"] > 0


def test_without_python_and_tables_npm_says_what_to_run(tmp_path: Path) -> None:
    """In a clone that nothing was set up in. Tables that are there are used."""
    if why := missing_tools():
        pytest.skip(why)
    script = tmp_path / "web/build/tables.js"
    script.parent.mkdir(parents=True)
    shutil.copyfile(checkout_root() / "web/build/tables.js", script)
    (tmp_path / "web/package.json").write_text('{"type": "module"}')
    (tmp_path / "tools").mkdir()

    def run() -> subprocess.CompletedProcess[str]:
        argv = [str(shutil.which("node")), str(script)]
        return subprocess.run(argv, env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=False)

    refused = run()
    assert refused.returncode != 0 and "Run `python tools/dev.py setup`" in refused.stderr
    (tmp_path / "build/generated").mkdir(parents=True)
    (tmp_path / "build/generated/.stamp").touch()
    assert run().returncode == 0


@pytest.mark.alike(6)
@pytest.mark.parametrize("board_id", ESP32_BOARDS)
@pytest.mark.parametrize("kind", ["output", "input"])
def test_the_page_allows_the_pins_that_the_firmware_allows(board_id: str, kind: str) -> None:
    (board,) = board_tables([load_board(board_id)])
    allowed = [f"{pin['number']}u" for pin in board["pins"] if pin[kind] is None]
    define = f"BOARD_FREE_{kind.upper()}_PINS"
    line = next(line for line in pin_header_text(load_board(board_id)).splitlines() if define in line)
    assert line.split("{")[1].rstrip("}").split(", ") == allowed
    wired = {use["number"] for use in board["uses"]}  # whose pin it is, the page adds
    refused = [pin for pin in board["pins"] if pin[kind] is not None and pin["number"] not in wired]
    assert all(pin[kind] and all(len(reason) > 10 for reason in pin[kind]) for pin in refused), "a refusal says why"
