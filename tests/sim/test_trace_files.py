"""CSV, VCD and NPZ: exact times, agreement with each other, viewers' rules, full disks."""

from __future__ import annotations

import errno
import re
from pathlib import Path

import numpy as np
import pytest
from c_library import EVENT
from sim_native import events, write_trace
from wificnc.simulator.trace import raw_to_npz, signal_names

NAMES = signal_names({"step_x": "GPIO1", "dir_x": "GPIO2"}, "XYZ")
VCD = {"names": NAMES, "pulse_ns": 2500, "setup_ns": 1000}


def random_trace(count: int = 10_000, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    trace = np.zeros(count, dtype=EVENT)
    trace["t"] = np.cumsum(rng.integers(150, 20_000, count)) + 300
    trace["step"] = rng.integers(1, 8, count)
    trace["dir"] = rng.integers(0, 8, count)
    return trace


def read_csv(path: Path) -> np.ndarray:
    lines = path.read_text().splitlines()
    assert lines[0] == "t_ns,step_mask,dir_mask,duty"
    return np.array([[int(field) for field in line.split(",")] for line in lines[1:]], dtype=np.uint64)


def read_vcd(path: Path) -> tuple[dict[str, str], dict[str, str], list[tuple[int, str, str]]]:
    """Names by code, initial levels, changes (t, code, level)."""
    head, body = path.read_text().split("$enddefinitions $end\n")
    assert "$timescale 1 ns $end" in head
    names = dict(re.findall(r"\$var wire 1 (\S) (\S+) \$end", head))
    initial, changes, now = {}, [], None
    for line in body.splitlines():
        if line.startswith("#"):
            assert now is None or int(line[1:]) > now or now == 0, "time goes forward"
            now = int(line[1:])
        elif line in ("$dumpvars", "$end") or line.startswith("b"):
            continue
        elif line[1] not in initial:
            initial[line[1]] = line[0]
        else:
            changes.append((now, line[1], line[0]))
    return names, initial, changes


@pytest.mark.parametrize("hz", [1_000_000, 20_000_000, 80_000_000, 33_333_333, 99_999_989])
def test_ticks_become_ns_exactly(library, tmp_path, hz):
    century = 100 * 365 * 86400 * hz
    ticks = [0, 1, 2, hz - 1, hz, hz + 1, 7 * hz // 3, century, century + 1]
    path = tmp_path / "t.csv"
    assert write_trace(library, events([(t, 1, 0) for t in ticks]), path, hz) == 0
    assert read_csv(path)[:, 0].tolist() == [t * 10**9 // hz for t in ticks]


def test_csv_and_npz_hold_every_event(library, tmp_path):
    trace = random_trace(70_000)
    csv, raw, npz = tmp_path / "t.csv", tmp_path / "t.raw", tmp_path / "t.npz"
    assert write_trace(library, trace, csv, 20_000_000) == 0
    assert write_trace(library, trace, raw, 20_000_000) == 0
    raw_to_npz(raw, npz)
    rows = read_csv(csv)
    assert rows[:, 0].tolist() == (trace["t"] * 50).tolist()
    assert rows[:, 1].tolist() == trace["step"].tolist() and rows[:, 2].tolist() == trace["dir"].tolist()
    with np.load(npz) as arrays:
        assert sorted(arrays) == ["dir_mask", "duty", "step_mask", "t_ns"]
        assert arrays["t_ns"].dtype == np.uint64 and arrays["step_mask"].dtype == np.uint8
        for column, key in enumerate(("t_ns", "step_mask", "dir_mask", "duty")):
            assert np.array_equal(arrays[key], rows[:, column])


def test_npz_of_no_events(library, tmp_path):
    raw, npz = tmp_path / "t.raw", tmp_path / "t.npz"
    assert write_trace(library, events([]), raw, 1_000_000) == 0
    raw_to_npz(raw, npz)
    with np.load(npz) as arrays:
        assert all(arrays[key].shape == (0,) for key in ("t_ns", "step_mask", "dir_mask", "duty"))


def test_vcd_says_what_the_csv_says(library, tmp_path):
    trace = random_trace()
    path = tmp_path / "t.vcd"
    assert write_trace(library, trace, path, 20_000_000, **VCD) == 0
    names, initial, changes = read_vcd(path)
    assert list(names.values()) == ["step_x_GPIO1", "step_y", "step_z", "dir_x_GPIO2", "dir_y", "dir_z"]
    assert set(initial.values()) == {"0"} and set(initial) == set(names)
    code = {name.split("_GPIO")[0]: code for code, name in names.items()}
    for axis, letter in enumerate("xyz"):
        rises = [t for t, c, level in changes if c == code[f"step_{letter}"] and level == "1"]
        falls = [t for t, c, level in changes if c == code[f"step_{letter}"] and level == "0"]
        mine = trace[trace["step"] >> axis & 1 == 1]
        assert rises == (mine["t"] * 50).tolist()
        assert falls == [t + 2500 for t in rises]
        turns = [(t, int(level)) for t, c, level in changes if c == code[f"dir_{letter}"]]
        levels = trace["dir"] >> axis & 1
        turned = np.flatnonzero(np.diff(levels, prepend=0) != 0)
        assert [level for _, level in turns] == levels[turned].tolist()
        assert [t for t, _ in turns] == (trace["t"][turned] * 50 - 1000).tolist()


def test_vcd_shows_a_train_that_is_too_fast(library, tmp_path):
    path = tmp_path / "t.vcd"
    assert write_trace(library, events([(100, 1, 0), (120, 1, 0)]), path, 20_000_000, **VCD) == 0
    _, _, changes = read_vcd(path)
    assert changes == [(5000, "!", "1"), (5999, "!", "0"), (6000, "!", "1"), (8500, "!", "0")]


def test_vcd_names_are_plain_words(library, tmp_path):
    path = tmp_path / "t.vcd"
    names = ("step x(GPIO 1)[0]$", *(None,) * 11)
    assert write_trace(library, events([(1, 1, 0)]), path, 1_000_000, names=names, pulse_ns=10, setup_ns=0) == 0
    assert list(read_vcd(path)[0].values()) == ["step_x_GPIO_1__0__"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("suffix", [".csv", ".vcd", ".raw"])
def test_a_full_disk_is_told(library, tmp_path, suffix):
    path = tmp_path / f"full{suffix}"
    path.symlink_to("/dev/full")
    assert write_trace(library, random_trace(50_000), path, 1_000_000, **VCD) == errno.ENOSPC
    assert write_trace(library, random_trace(1), path, 1_000_000, **VCD) == errno.ENOSPC  # at closing


def test_a_file_that_cannot_be_made_is_told(library, tmp_path):
    assert write_trace(library, random_trace(1), tmp_path / "no" / "t.csv", 1_000_000) == errno.ENOENT
