"""What a laser burns by length, against the formulas of a trapezoid of speed and the power on the pins; and the warning
where constant power burns too much."""

from __future__ import annotations

import ctypes
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from layouts import HOST
from test_sim_job import SETTINGS, run
from wificnc.simulator.job import At, Engraving
from wificnc.simulator.library import PIECE_DTYPE
from wificnc.simulator.trace import TraceFile

ACCEL = 500.0  # of SETTINGS, mm/s2
LASER = (*SETTINGS, "$32=1", "$30=1000")
FULL = 65535
Piece = HOST.struct("engraving_piece")
Part = HOST.struct("engraving_part")
Result = HOST.struct("engraving_result")


def burn(library: ctypes.CDLL, text: str, **options: object) -> Engraving:
    result = run(library, text, **{"settings": LASER, **options})
    assert result.errors == () and result.engraving is not None
    return result.engraving


def pieces_of(engraving: Engraving) -> np.ndarray:
    return np.frombuffer(engraving.pieces, dtype=PIECE_DTYPE)


def by_length(pieces: np.ndarray) -> np.ndarray:
    return pieces["energy_s"] / pieces["length_mm"]


def energy_until(pieces: np.ndarray, x_mm: np.ndarray) -> np.ndarray:
    """Of a line along X from 0."""
    ends, sums = pieces["to_mm"][:, 0].astype(float), np.cumsum(pieces["energy_s"].astype(float))
    return np.interp(x_mm, np.append(0, ends), np.append(0, sums))


@pytest.mark.parametrize(("power", "feed"), [(1000, 600), (500, 3000), (30, 1200)])
def test_constant_power_at_the_feed_is_power_by_speed(library, power, feed):
    engraving = burn(library, f"M3S{power}F{feed}\nG1X100\nM5\n")
    at_mm = np.arange(10, 91, 10)
    per_mm = np.diff(energy_until(pieces_of(engraving), at_mm)) / 10
    assert per_mm == pytest.approx(power / 1000 / (feed / 60), rel=1e-3)
    assert engraving.length_mm == pytest.approx(100, abs=0.01)


@pytest.mark.parametrize("extra", [(), ("$40=20000",), ("$80=1",)])
@pytest.mark.parametrize("feed", [600, 3000])
def test_dynamic_power_burns_each_length_alike(library, feed, extra):
    engraving = burn(library, f"M4S800F{feed}\nG1X50\nY10\nX0\nM5\n", settings=(*LASER, *extra))
    pieces = pieces_of(engraving)
    visible = pieces["length_mm"] > 0.01
    assert by_length(pieces[visible]) == pytest.approx(0.8 * 60 / feed, rel=0.02)
    assert pieces["energy_s"].sum() == pytest.approx(0.8 * 60 / feed * engraving.length_mm, rel=0.002)
    assert (engraving.constant_mm, engraving.slow_mm, engraving.worst) == (0, 0, 0)


def test_constant_power_burns_the_ends_by_the_ratio_of_speeds(library):
    """From rest the first x mm take sqrt(2 x / a); the last ones as long."""
    v = 50.0
    engraving = burn(library, "M3S1000F3000\nG1X100\nM5\n")
    pieces, ramp_mm = pieces_of(engraving), v * v / 2 / ACCEL
    x = np.arange(0.1, ramp_mm, 0.1)
    assert energy_until(pieces, x) == pytest.approx(np.sqrt(2 * x / ACCEL), rel=0.03)
    whole = energy_until(pieces, np.array([100.0]))[0]
    assert whole - energy_until(pieces, 100 - x) == pytest.approx(np.sqrt(2 * x / ACCEL), rel=0.03)
    middle = (pieces["from_mm"][:, 0] + pieces["to_mm"][:, 0]) / 2
    ramp = (middle > 0.2) & (middle < ramp_mm - 0.1)
    assert by_length(pieces[ramp]) == pytest.approx(1 / np.sqrt(2 * ACCEL * middle[ramp]), rel=0.03)


@pytest.mark.parametrize(("feed", "accel"), [(3000, 500), (6000, 2000), (1200, 200)])
def test_the_warning_has_the_figures_of_a_trapezoid(library, feed, accel):
    """v > f / 1.2 beyond (f / 1.2)^2 / 2a; the mean of the first d mm is sqrt(2 / (a d)) at full power."""
    f, length = feed / 60, 40.0
    engraving = burn(library, f"M3S700F{feed}\nG1X{length:g}\nM5\n", settings=(*LASER, f"$120={accel}", "$110=9000"))
    assert engraving.constant_mm == pytest.approx(length, abs=0.01)
    assert engraving.slow_mm == pytest.approx(2 * (f / 1.2) ** 2 / 2 / accel, abs=0.35)
    assert f * sqrt(2 / (accel * 0.2)) < engraving.worst <= f * sqrt(2 / (accel * 0.1)) * 1.01
    assert (engraving.limit, engraving.worst_line) == (1.2, 2)


def test_the_warning_names_the_worst_place(library):
    """Over-scan of 10 mm, so only the corner in line 5 is slow."""
    engraving = burn(library, "M3S0F3000\nG1X10\nS900\nX40\nY30\nS0\nY40\nM5\n")
    assert engraving.worst_line in (4, 5)
    assert engraving.worst_mm == pytest.approx((40, 0, 0), abs=0.6)
    assert engraving.worst > 3 and 1 < engraving.slow_mm < 6
    assert engraving.constant_mm == pytest.approx(60, abs=0.1)


@pytest.mark.parametrize("feed", [300, 3000])
def test_a_feed_that_is_kept_is_no_warning(library, feed):
    engraving = burn(library, f"M3S0F{feed}\nG1X10\nX40S500\nX50S0\nM5\n")
    assert engraving.constant_mm == pytest.approx(30, abs=0.05)
    assert engraving.slow_mm == 0 and 0.99 < engraving.worst < 1.02


def test_a_feed_above_the_maximum_rate_is_too_slow_everywhere(library):
    engraving = burn(library, "M3S0F12000\nG1X10\nX40S500\nX60S0\nM5\n")  # $110 = 5000
    assert engraving.worst == pytest.approx(12000 / 5000, rel=0.01)
    assert engraving.slow_mm == pytest.approx(30, abs=0.1)


@pytest.mark.parametrize(
    "text", ["G0X10\n", "M3S1000\nG0X10\nM5\n", "M3S0F600\nG1X10\nM5\n", "M5S1000F600\nG1X10\n", "M3S1000F600\nG4P1\n"]
)
def test_a_dark_job_burns_nothing(library, text):
    assert run(library, text, settings=LASER).engraving is None


def test_a_spindle_is_no_laser(library):
    assert run(library, "M3S1000F600\nG1X10\nM5\n", settings=SETTINGS).engraving is None


def test_an_open_door_darkens_the_beam(library):
    lit, opened = (
        run(library, "M3S1000F600\nG1X50\nM5\n", settings=LASER, events=events).engraving
        for events in ((), (At(1.0, "door"),))
    )
    assert lit and opened
    assert opened.length_mm == pytest.approx(10 - 10 * 10 / ACCEL / 2, abs=0.3)


RASTER = "M3S0F3000\n" + "".join(
    f"G1X{row % 2 * 40}Y{row * 0.2:g}S0\n" + "".join(f"X{abs(row % 2 * 40 - x)}S{x * 23}\n" for x in range(1, 41))
    for row in range(6)
)


@pytest.mark.parametrize("extra", [(), ("$40=20000",), ("$80=1",), ("$30=500", "$31=20")])
@pytest.mark.parametrize("mode", ["M3", "M4"])
def test_the_energy_is_that_of_the_pins(library, tmp_path: Path, mode: str, extra: tuple[str, ...]):
    """Of the step trace: duty times the time to the next edge."""
    path = tmp_path / "trace.npz"
    trace = TraceFile(path, path, (None,) * 12)
    engraving = burn(library, RASTER.replace("M3", mode) + "M5\n", trace=trace, settings=(*LASER, *extra))
    trace.complete()
    trace.clean()
    with np.load(path) as arrays:
        edges = dict(arrays)
    pins_s = (edges["duty"][:-1] / FULL * np.diff(edges["t_ns"].astype(np.int64)) * 1e-9).sum()
    assert pieces_of(engraving)["energy_s"].sum() == pytest.approx(pins_s, rel=0.01)


def test_pieces_follow_a_circle(library):
    pieces = pieces_of(burn(library, "M4S1000F1200\nG2X20I10\nM5\n"))
    for name in ("from_mm", "to_mm"):
        assert np.hypot(pieces[name][:, 0] - 10, pieces[name][:, 1]) == pytest.approx(10, abs=0.01)
    assert 20 < len(pieces) < 1000


def feed_parts(library: ctypes.CDLL, count: int, power: np.ndarray, gap_mm: float = 0.0) -> tuple[np.ndarray, Result]:
    """So many parts of 0.1 mm in rows of 1000."""
    handle = library.engraving_create(1)
    library.engraving_line(handle, 0, 1, 50.0)
    part = Part(line=1, time_s=0.002)
    pitch = 0.1 + gap_mm
    for i in range(count):
        row, column = divmod(i, 1000)
        part.duty, part.length_mm = power[i], 0.1
        part.from_mm[0], part.to_mm[0] = column * pitch, column * pitch + 0.1
        part.from_mm[1] = part.to_mm[1] = row * 0.1
        library.engraving_take(handle, ctypes.byref(part))
    first = ctypes.POINTER(Piece)()
    number = library.engraving_pieces(handle, ctypes.byref(first))
    pieces = np.frombuffer(ctypes.string_at(first, number * ctypes.sizeof(Piece)), dtype=PIECE_DTYPE)
    result = Result()
    library.engraving_result(handle, ctypes.byref(result))
    assert not library.engraving_lost(handle)
    library.engraving_destroy(handle)
    return pieces, result


@pytest.mark.slow
@pytest.mark.parametrize("gap_mm", [0.0, 0.05])
def test_many_pieces_are_joined_not_lost(library, gap_mm):
    count = (1 << 20) + 50_000
    power = np.random.default_rng(1).uniform(0.1, 1, count)
    pieces, result = feed_parts(library, count, power, gap_mm)
    assert 500_000 < len(pieces) <= 1 << 20
    assert pieces["energy_s"].astype(float).sum() == pytest.approx(0.002 * power.sum(), rel=1e-5)
    assert result.length_mm == pytest.approx(0.1 * count, rel=1e-6)
    assert result.worst == pytest.approx(1.0, rel=1e-6)
    size = np.abs(pieces["to_mm"] - pieces["from_mm"])
    assert size.max() < 1.0


def test_what_burns_at_rest_stays_a_piece(library):
    handle = library.engraving_create(1)
    for length_mm, duty in ((1.0, 0.5), (0.0, 0.1), (1.0, 0.5)):
        library.engraving_take(handle, ctypes.byref(Part(line=1, time_s=0.5, duty=duty, length_mm=length_mm)))
    first = ctypes.POINTER(Piece)()
    assert library.engraving_pieces(handle, ctypes.byref(first)) == 3
    assert (first[1].length_mm, first[1].energy_s) == (0, pytest.approx(0.05))
    library.engraving_destroy(handle)
