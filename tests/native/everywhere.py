"""What must come out alike on every processor: programs through the whole controller, and a digest of each."""

from __future__ import annotations

import subprocess
from pathlib import Path

from patience import HANG_S
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

ROOT = checkout_root()
UNIT_TESTS = Path(__file__).parent / "test_core" / "test_core.c"
TRACE_DIGEST = (
    Path(__file__).parent / "digest" / "trace_digest.c"
)  # a program of its own: next to test_core PlatformIO links it in

# Everything that computes: arcs in all planes, splines, cycles, expressions, six axes, units, feed modes, holds.
PROGRAMS = {
    "arcs": b"G21\nG17G2X10Y10I10F3000\nG3X0Y0I-5J-5\nG18G2X5Z5I5K0\nG19G3Y5Z0J2.5K-2.5\nG17G2X0Y0I-2.5J-2.5P3\n",
    "splines": b"G17G5X10Y0I3J7P-3Q7F2000\nG5X20Y5P-4Q-4\nG5.1X30Y0I5J9\n",
    "cycles": b"G81X5Y5Z-3R1F500\nX9\nG83X0Z-6R2Q1.7\nG80\nG73X3Y3Z-5R1Q2\nG80\n",
    "axes": b"G93G1X1Y2Z3A40B-50C60F30\nG94\nG20G1X1A7.123F20\nG21G0X0Y0Z0A0B0C0\n",
    "corners": b"G64P0.02\n" + b"".join(b"G1X%dY%dF6000\n" % (n % 7 * 3, n * n % 11) for n in range(40)),
    "formulas": b"#1=[SIN[37]*12.5]\nG1X#1Y[SQRT[2]*#1]F1500\n#2=[ATAN[3]/[4]]\nG1X[#2/9]\nG4P0.01\n",
    "lines": b"G61\nG1X0.001F1\nG1X33.333Y-12.07F12000\n$J=G91X5F4000\n$$\n?\n",
}


def programs() -> dict[str, bytes]:
    """Those above, and the beginning of each example."""
    examples = sorted((ROOT / "examples").glob("*.nc"))
    return PROGRAMS | {path.name: b"".join(path.read_bytes().splitlines(keepends=True)[:20]) for path in examples}


def texts() -> bytes:
    """As trace_digest.c reads them."""
    return b"".join(text + b"\0" for text in programs().values())


def differences(found: str) -> list[str]:
    """Names of the programs whose digest is not this computer's."""
    here = build_program([TRACE_DIGEST], ROOT / "build" / "tests" / "trace_digest", "release", [])
    wanted = subprocess.run([here], input=texts(), capture_output=True, timeout=HANG_S, check=True).stdout.decode()
    assert sum(int(line.split()[0]) for line in wanted.splitlines()) > 50_000  # step edges
    pairs = zip(programs(), wanted.splitlines(), found.splitlines(), strict=True)
    return [name for name, one, other in pairs if one != other]
