"""What the seal of the longest datagram costs on an ESP32, counted in an emulator of its instructions."""

from __future__ import annotations

from pathlib import Path

import pytest
from patience import HANG_S
from xtensa import windows
from xtensa.headers import small_headers
from xtensa.toolchain import Toolchain

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent
REAL = ("core/wire/seal.c", "core/base/siphash.c", "core/base/sha256.c", "core/wire/wire_gen.c")
UNIT, WRONG = 64, 255  # tests/xtensa/seal/main.c
HEAD, SEGMENT = 18 + 12, 44  # bytes of a stream_segments datagram


def cost(tools: Toolchain, folder: Path, segments: int) -> int:
    """Instructions, at most, for the seal of a datagram with so many segments."""
    size = folder / "size.S"
    size.write_text(f".data\n.balign 4\n.global datagram_size\ndatagram_size: .4byte {HEAD + segments * SEGMENT}\n")
    headers = small_headers(ROOT, "esp32", folder)
    sources = [*(ROOT / name for name in REAL), HERE / "seal" / "main.c", size, HERE / "vector" / "start.S"]
    units = windows.run(windows.build(tools, ROOT, headers, sources, folder), HANG_S)
    assert units != WRONG, "the seal is refused, or accepted twice, or no SipHash-1-3"
    return UNIT * units


@pytest.mark.parametrize(("segments", "budget"), [(1, 1100), (4, 2100), (8, 3400)])
def test_a_seal_costs_little(tools: Toolchain, tmp_path: Path, segments: int, budget: int) -> None:
    """One segment every 10 ms is what hosts send, and eight, the most that fit, after a loss: docs/performance.md."""
    if said := windows.missing(tools):
        pytest.skip(said)
    assert 500 < cost(tools, tmp_path, segments) <= budget
