"""What the keys of the binary protocol must say of a board: read from its TOML and its chip's, by nothing of ours."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
NONE = 0xFF
CHIPS = {"esp32": "esp32/pins-esp32", "esp32s3": "esp32/pins-esp32s3", "host": "pc/pins"}
SHIFTED = 64  # I2SO.0


def published_keys(path: Path) -> dict[int, int]:
    """Pins 0x0500 to 0x0703 and what else a board decides, as docs/protocol.md describes them."""
    board = tomllib.loads(path.read_text(encoding="utf-8"))
    chip = tomllib.loads((ROOT / "targets" / f"{CHIPS[board['chip']]}.toml").read_text(encoding="utf-8"))
    axes = [board["axis"].get(letter, {}) for letter in "xyzabc"]
    output, given, encoder = (board.get(table, {}) for table in ("output", "input", "encoder"))
    ethernet = board.get("ethernet", {})

    def number(wire: Any) -> int:
        if wire is None:
            return NONE
        name = wire["pin"] if isinstance(wire, dict) else wire
        return SHIFTED + int(name[5:]) if name.startswith("I2SO.") else int(chip["pin"][name]["number"])

    def nth(wires: list[Any], n: int) -> int:
        return number(wires[n]) if n < len(wires) else NONE

    keys = {0x0500 + n: number(axis.get("step")) for n, axis in enumerate(axes)}
    keys |= {0x0506 + n: number(axis.get("dir")) for n, axis in enumerate(axes)}
    keys[0x050C] = number(output.get("enable"))
    for n, axis in enumerate(axes):
        keys[0x050D + n] = number(axis.get("limit") or axis.get("limit_min") or axis.get("limit_max"))
    keys[0x0513], keys[0x0514] = number(given.get("probe")), number(given.get("estop"))
    keys[0x0515] = number(output.get("spindle_enable") or output.get("spindle_pwm"))
    keys[0x0516], keys[0x0517] = number(board.get("led", {}).get("pin")), number(output.get("charge_pump"))
    keys |= {0x0518 + n: nth(output.get("misc", []), n) for n in range(2)}
    keys |= {0x0520 + n: number(encoder.get(line)) for n, line in enumerate(("a", "b", "index"))}
    keys |= {0x0530 + n: nth(given.get("misc", []), n) for n in range(4)}
    keys |= {0x0700 + n: number(ethernet.get(line)) for n, line in enumerate(("mosi", "miso", "sclk", "int"))}
    keys[0x0704] = chip["spi_hosts"][ethernet["spi_host"]] if ethernet else 0
    estop = given.get("estop")
    keys[0x0312] = int(isinstance(estop, dict) and estop.get("active") == "high")
    keys[0x0525] = 500 if "b" in encoder and board["target"] == "esp32" else 0  # targets/esp32/io/encoder.c
    return keys
