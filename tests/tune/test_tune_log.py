"""Logs of an accelerometer with a vibration that is known, in the forms that loggers write."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from wificnc.errors import JobError, UserError
from wificnc.tune.accelerometer import Log, read_log
from wificnc.tune.spectrum import analyse, search_band

RATE = 1600.0


def knocks(hz: float, damping: float, times_s: tuple[float, ...], seconds: float, rate: float = RATE) -> np.ndarray:
    """Free vibrations after knocks: the sum of exp(-z w t) sin(wd t)."""
    omega = 2 * math.pi * hz
    t_s = np.arange(int(seconds * rate)) / rate
    total = np.zeros(len(t_s))
    for begin in times_s:
        t = np.maximum(t_s - begin, 0.0)
        total += np.where(t_s >= begin, np.exp(-damping * omega * t) * np.sin(omega * math.sqrt(1 - damping**2) * t), 0)
    return total


def shaken(hz: float, damping: float, seconds: float, rng: np.random.Generator) -> np.ndarray:
    """The acceleration of a mass that a random force drives, exactly from sample to sample."""
    omega = 2 * math.pi * hz
    pole = complex(-damping * omega, omega * math.sqrt(1 - damping**2))
    turn, z = np.exp(pole / RATE), 0j
    values = np.empty(int(seconds * RATE))
    for index, force in enumerate(rng.normal(size=len(values))):
        z = turn * z + force
        values[index] = (pole**2 * z).imag / omega**2
    return values / values.std()


@pytest.mark.parametrize("hz", [9.0, 18.0, 41.3, 77.0, 150.0])
@pytest.mark.parametrize("damping", [0.01, 0.03, 0.1])
def test_a_knock_in_noise_is_recovered(hz, damping):
    rng = np.random.default_rng(7)
    values = knocks(hz, damping, (0.5,), 4.0)
    found = analyse(Log("x", RATE, values + rng.normal(scale=0.02, size=len(values)), 0), 5.0, 200.0)
    assert found.mode.hz == pytest.approx(hz, rel=0.01)
    assert found.mode.damping == pytest.approx(damping, rel=0.2)


@pytest.mark.parametrize(("hz", "damping"), [(23.0, 0.02), (41.3, 0.05), (110.0, 0.02)])
def test_many_knocks_are_recovered(hz, damping):
    rng = np.random.default_rng(3)
    values = knocks(hz, damping, (0.5, 1.7, 2.4, 4.1, 5.0, 6.3, 7.9, 9.2), 10.0)
    found = analyse(Log("x", RATE, values + rng.normal(scale=0.05, size=len(values)), 0), 5.0, 200.0)
    assert found.mode.hz == pytest.approx(hz, rel=0.01)
    assert found.mode.damping == pytest.approx(damping, rel=0.2)


@pytest.mark.parametrize(("hz", "damping"), [(35.0, 0.03), (80.0, 0.05)])
def test_a_shaken_mass_is_recovered(hz, damping):
    rng = np.random.default_rng(5)
    values = shaken(hz, damping, 60.0, rng)
    found = analyse(Log("x", RATE, values + rng.normal(scale=0.3, size=len(values)), 0), 5.0, 200.0)
    assert found.mode.hz == pytest.approx(hz, rel=0.01)
    assert found.mode.damping == pytest.approx(damping, rel=0.2)


def test_a_second_vibration_is_named():
    values = knocks(30.0, 0.02, (0.5,), 6.0) + 2.0 * knocks(75.0, 0.02, (0.5,), 6.0)
    found = analyse(Log("x", RATE, values, 0), 5.0, 200.0)
    assert found.mode.hz == pytest.approx(30.0, rel=0.03)  # the skirts of the two interfere
    assert found.other_peaks_hz == pytest.approx((75.0,), rel=0.02)


def test_slow_motion_of_the_machine_does_not_matter():
    """Accelerations of the moves, at 1 Hz and far above the vibration."""
    values = knocks(41.3, 0.02, (0.5, 2.5), 5.0)
    moves = 20.0 * np.sin(2 * np.pi * np.arange(len(values)) / RATE)
    assert analyse(Log("x", RATE, values + moves, 0), 5.0, 200.0).mode.hz == pytest.approx(41.3, rel=0.01)


def test_noise_has_no_frequency():
    values = np.random.default_rng(1).normal(size=16000)
    with pytest.raises(JobError, match="no clear vibration between 5 and 200 Hz"):
        analyse(Log("x", RATE, values, 0), 5.0, 200.0)


def test_a_rate_below_twice_the_frequency_is_refused():
    with pytest.raises(UserError, match=r"100 samples/s show vibrations below 50 Hz only, not 80 Hz") as refused:
        search_band(Log("x", 100.0, knocks(30.0, 0.02, (0.5,), 5.0, 100.0), 0), None, 80.0)
    assert refused.value.hint == "log faster than 160 samples/s, or search --to-hz 40"


# ---- files ----


def table(header: str, unit_s: float = 1.0, columns: int = 3, delimiter: str = ",") -> str:
    """Uneven samples of 41.3 Hz in the first column of acceleration, noise in the others, a time that starts late."""
    rng = np.random.default_rng(2)
    t_s = np.cumsum(rng.uniform(0.5, 1.5, 8000) / RATE)
    omega = 2 * math.pi * 41.3
    t = np.maximum(t_s - 1.0, 0.0)
    values = np.exp(-0.02 * omega * t) * np.sin(omega * t)
    rows = [
        delimiter.join([repr(1e3 + float(time) / unit_s), repr(float(value)), *("0.5",) * (columns - 1)])
        for time, value in zip(t_s, values, strict=True)
    ]
    return header + "\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    ("header", "unit_s", "columns", "delimiter"),
    [
        ("#time,accel_x,accel_y,accel_z", 1.0, 3, ","),
        ("time,ax,ay", 1.0, 2, ","),
        ("t_ms,x", 1e-3, 1, ","),
        ("Time (us);X;Y;Z", 1e-6, 3, ";"),
        ('"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)"', 1.0, 2, ","),
        ("time\tgFx\tgFy\tgFz", 1.0, 3, "\t"),
        ("timestamp_ns,acc_x,acc_y,acc_z", 1e-9, 3, ","),
        ("seconds_elapsed,accel", 1.0, 1, ","),
    ],
)
def test_headers_of_common_loggers(header, unit_s, columns, delimiter, tmp_path):
    path = tmp_path / "accel.csv"
    path.write_text(table(header, unit_s, columns, delimiter))
    log = read_log(path, "x")
    assert log.rate_hz == pytest.approx(RATE, rel=0.01) and log.gaps == 0
    assert analyse(log, 5.0, 200.0).mode.hz == pytest.approx(41.3, rel=0.01)


def test_nanoseconds_since_1970_next_to_elapsed_seconds(tmp_path):
    """Sensor Logger's columns, and the axes in its order."""
    lines = table("t,x").splitlines()[1:]
    rows = [f"17{'0' * 17},{line.split(',')[0]},0,0,{line.split(',')[1]}" for line in lines]
    path = tmp_path / "Accelerometer.csv"
    path.write_text("time,seconds_elapsed,z,y,x\n" + "\n".join(rows))
    assert analyse(read_log(path, "x"), 5.0, 200.0).mode.hz == pytest.approx(41.3, rel=0.01)


def test_decimal_commas_and_comments(tmp_path):
    path = tmp_path / "accel.csv"
    path.write_text("﻿" + table("t;x", columns=1, delimiter=";").replace(".", ",").replace("\n", "\n# note\n", 1))
    assert read_log(path, "x").rate_hz == pytest.approx(RATE, rel=0.01)


def long(header: str, row: str = "{t},0.5", count: int = 1000) -> str:
    return "\n".join([header, *(row.format(t=index / RATE) for index in range(count))])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        (long("x,y"), "accel.csv:1: no column of time among 'x', 'y'"),
        (
            long("time,temperature,light", "{t},1,2"),
            "no column of acceleration in X among 'time', 'temperature', 'light'",
        ),
        (long("t_days,x"), "accel.csv:1: unknown unit of time in 't_days'"),
        (long("time,x", count=100), "too short: 100 samples, at least 256"),
        (long("time,x") + "\n1.0,oops", "accel.csv:1002: 'oops' is not a number"),
        (long("time,x") + "\n1.0", "accel.csv:1002: only 1 columns"),
        (long("time,x") + "\n1.0,nan", "accel.csv:1002: nan is not a finite number"),
        (long("time,x") + "\n0.1,1", "time goes back near line 1002"),
        (long("time_us,x"), "different times in 6.24e-07 s; at least 256 in 0.5 s"),
        ("time,x\n0,1\n1," + "1" * 200_000, "is not a table"),
    ],
)
def test_what_is_no_log_is_refused(text: str, words: str, tmp_path: Path):
    path = tmp_path / "accel.csv"
    path.write_text(text)
    with pytest.raises(UserError) as refused:
        read_log(path, "x")
    assert words in refused.value.message


def test_the_command(tune, tmp_path):
    path = tmp_path / "accel.csv"
    path.write_text(table("#time,accel_x,accel_y,accel_z"))
    code, out, err = tune("log", path)
    lines = out.splitlines()
    assert code == 0 and re.match(r"X: 41\.[23]\d Hz", lines[1]) and "recommended: MZV" in lines[-2]
    assert re.fullmatch(r"\$170=2 \$180=41\.[23]\d \$190=0\.0[12]\d", lines[-1])
    assert tune("log", path, "--axis", "y")[0] == 1  # silent
    assert tune("log", tmp_path / "none.csv")[0] == 2
    code, _, err = tune("log", path, "--to-hz", "300")
    assert code == 2 and "search from 5 to 300 Hz: must be within 5 to 200 Hz" in err


@pytest.mark.parametrize("words", [("log", "accel.csv"), ("predict", "job.nc", "--hz", "40")])
def test_a_missing_package_is_named(words, tune, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    code, _, err = tune(*words)
    assert code == 2 and f"tune {words[0]} needs numpy" in err and "pip install numpy" in err


def test_a_log_that_is_too_slow_for_any_vibration(tune, tmp_path):
    path = tmp_path / "accel.csv"
    path.write_text("\n".join(["time,x", *(f"{index / 10},{index % 3}" for index in range(600))]))
    code, _, err = tune("log", path)
    assert code == 2 and "10 samples/s show vibrations below 5 Hz only, not 6 Hz" in " ".join(err.split())
