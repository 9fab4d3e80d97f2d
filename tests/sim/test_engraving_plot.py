"""The picture of what a laser burns: grey by energy per mm, as lines or as pixels, and what the user reads about it."""

from __future__ import annotations

import ctypes
import io
import json
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from test_engraving import LASER, RASTER, burn
from test_sim_cli import cli
from test_sim_job import run
from wificnc.app import main
from wificnc.simulator import engraving as drawing
from wificnc.simulator.engraving import Pieces, pieces_from, rasterise, unit
from wificnc.simulator.library import PIECE_DTYPE
from wificnc.simulator.plot import draw_job

__all__ = ["cli"]
SETTINGS = [word for line in LASER for word in ("--set", line)]
M3_LINE = "M3S700F3000\nG1X100\nM5\n"


def pieces(begins: np.ndarray, ends: np.ndarray, energy_by_mm: np.ndarray) -> Pieces:
    return Pieces(begins, ends, np.linalg.norm(ends - begins, axis=1), energy_by_mm)


def random_pieces(count: int, size_mm: float = 20.0) -> Pieces:
    rng = np.random.default_rng(5)
    begins = np.c_[rng.uniform(0, size_mm, (count, 2)), np.zeros(count)]
    return pieces(begins, begins + rng.uniform(-1, 1, (count, 3)) * [1, 1, 0], rng.uniform(1, 9, count))


def burn_pieces(library: ctypes.CDLL, text: str, laser_w: float | None) -> Pieces:
    return pieces_from(burn(library, text).pieces, laser_w)[0]


def test_energy_has_a_unit_of_its_own(library):
    found = burn_pieces(library, "M3S0F1200\nG1X10\nX30S500\nX40S0\nM5\n", None)
    assert unit(None) == "ms of full power per mm" and found.typical == pytest.approx(0.5 * 1000 / 20, rel=1e-3)
    found = burn_pieces(library, "M3S0F1200\nG1X10\nX30S500\nX40S0\nM5\n", 4.0)
    assert unit(4.0) == "J/mm" and found.typical == pytest.approx(4.0 * 0.5 / 20, rel=1e-3)


def test_pixels_keep_the_energy_of_a_line():
    """Two half lines along X, one with 3 ms/mm and one with 6, in pixels of 1 mm."""
    begins = np.array([[0.0, 2.5, 0.0], [5.0, 2.5, 0.0]])
    grey = rasterise(
        pieces(begins, begins + np.array([5, 0, 0]), np.array([3.0, 6.0])),
        begins[:, :2], begins[:, :2] + [5, 0], np.zeros(2), np.array([10.0, 5.0]), 10,
    )  # fmt: skip
    assert grey.shape == (5, 10)
    assert grey[2] == pytest.approx([3.0] * 5 + [6.0] * 5)
    assert np.isnan(np.delete(grey, 2, axis=0)).all()


def test_a_pixel_is_the_mean_of_what_goes_through_it():
    begins = np.array([[0.0, 0.2, 0.0], [0.0, 0.7, 0.0]])
    grey = rasterise(
        pieces(begins, begins + np.array([2, 0, 0]), np.array([2.0, 8.0])),
        begins[:, :2], begins[:, :2] + [2, 0], np.zeros(2), np.array([2.0, 1.0]), 2,
    )  # fmt: skip
    assert grey == pytest.approx(np.array([[5.0, 5.0]]))


@pytest.mark.parametrize("at_once", [7, 1000])
def test_pixels_do_not_depend_on_how_many_are_made_at_once(monkeypatch, at_once):
    found = random_pieces(500)
    picture = (found, found.from_mm[:, :2], found.to_mm[:, :2], np.array([2.0, 3.0]), np.array([18.0, 17.0]), 50)
    want = rasterise(*picture)
    monkeypatch.setattr(drawing, "PARTS_AT_ONCE", at_once)
    assert np.allclose(rasterise(*picture), want, equal_nan=True)
    assert np.nanmin(want) >= 1 and np.nanmax(want) <= 9


def test_slow_corners_do_not_set_the_scale():
    along = np.arange(100.0)
    begins = np.c_[along, np.zeros((100, 2))]
    energy = np.where(along < 3, 80.0, 10.0)
    found = pieces(begins, begins + np.array([1, 0, 0]), energy)
    assert found.typical == 10.0 and found.black == 15.0


def test_a_place_that_burns_at_rest_is_no_piece():
    records = np.zeros(2, dtype=PIECE_DTYPE)
    records["energy_s"] = 0.5
    records[0]["from_mm"] = records[0]["to_mm"] = (3, 4, 0)
    records[1]["to_mm"], records[1]["length_mm"] = (5, 0, 0), 5
    found, at_rest = pieces_from(records.tobytes(), None)
    assert at_rest.tolist() == [[3, 4, 0]] and found.energy_by_mm == pytest.approx([100.0])


def darkness(png: bytes) -> np.ndarray:
    """0 white .. 1 black, of the rows and columns of the top view; colours count as white."""
    picture = matplotlib.image.imread(io.BytesIO(png))[:, :, :3]
    height, width = picture.shape[:2]
    view = picture[int(0.14 * height) : int(0.66 * height), int(0.06 * width) : int(0.47 * width)]
    return np.where(np.ptp(view, axis=2) < 0.02, 1 - view.mean(axis=2), 0.0)


def profile(dark: np.ndarray) -> np.ndarray:
    """The darkest of each column, from the first to the last one that is burnt."""
    columns = dark.max(axis=0)
    lit = np.flatnonzero(columns > 0.2)
    return columns[lit[0] : lit[-1] + 1]


@pytest.mark.parametrize("dense", [False, True])
def test_a_line_with_constant_power_is_darker_at_its_ends(library, monkeypatch, dense):
    if dense:
        monkeypatch.setattr("wificnc.simulator.look.ENGRAVING_DENSE", 0)
    rows = "".join(f"G0X{n % 2 * 30}Y{n}\nG1X{30 - n % 2 * 30}\n" for n in range(15))
    shown = {}
    for mode in ("M3", "M4"):
        result = run(library, f"{mode}S700F3000\n{rows}M5\n", settings=LASER, samples=True)
        shown[mode] = profile(darkness(draw_job(result, "png")))
    middle = {mode: np.median(dark) for mode, dark in shown.items()}
    ends = {mode: min(dark[6:20].max(), dark[-20:-6].max()) for mode, dark in shown.items()}
    assert ends["M3"] > middle["M3"] + 0.25
    assert ends["M4"] == pytest.approx(middle["M4"], abs=0.05)


def test_a_million_pieces_become_pixels():
    found = random_pieces(1 << 20, 200.0)
    grey = rasterise(found, found.from_mm[:, :2], found.to_mm[:, :2], np.zeros(2), np.full(2, 200.0), 800)
    assert grey.shape == (800, 800) and np.isfinite(grey).mean() > 0.9
    assert np.nanmean(grey) == pytest.approx(5.0, abs=0.1)


def test_a_raster_gives_a_picture(library):
    result = run(library, RASTER + "M5\n", settings=LASER, samples=True)
    for suffix, begin in (("png", b"\x89PNG"), ("svg", b"<?xml")):
        picture = draw_job(result, suffix, 5.0)
        assert picture.startswith(begin) and picture == draw_job(result, suffix, 5.0)


def test_what_burns_at_rest_is_marked(library):
    result = run(library, M3_LINE, settings=LASER, samples=True)
    assert result.engraving
    dot = np.zeros(1, dtype=PIECE_DTYPE)
    dot["from_mm"] = dot["to_mm"] = (50, 20, 0)
    dot["energy_s"] = 0.5
    burnt = replace(result.engraving, pieces=result.engraving.pieces + dot.tobytes())
    marked = replace(result, engraving=burnt, box_max_mm=(100.0, 40.0, 0.0))
    red = [reds(draw_job(job, "png")) for job in (replace(result, box_max_mm=(100.0, 40.0, 0.0)), marked)]
    assert red[1] > red[0] + 20


def reds(png: bytes) -> int:
    picture = matplotlib.image.imread(io.BytesIO(png))[:, :, :3]
    return int(((picture[:, :, 0] > 0.6) & (picture[:, :, 1:].max(axis=2) < 0.3)).sum())


# ---- what the user reads ----


def test_the_warning_says_what_where_and_how_to_fix_it(cli, job):
    path = job(M3_LINE)
    code, _, err = cli(path, *SETTINGS)
    assert code == 0
    said = " ".join(err.split())
    assert "warning: constant power (M3) burns more where the machine is slower than F: " in said
    assert "more than 1.2 x the energy of the feed on 3.5 mm of 100.0 mm" in said
    assert "in line 2 at X0.000 Y0.000 Z0.000" in said
    assert "hint: " in said and "M4" in said and "overscan" in said


@pytest.mark.parametrize("text", [M3_LINE.replace("M3", "M4"), "M3S0F3000\nG1X10\nX40S500\nX50S0\nM5\n", "G1X9F600\n"])
def test_no_warning_without_a_reason(cli, job, text):
    code, _, err = cli(job(text), *SETTINGS)
    assert code == 0 and err == ""


def test_json_has_the_figures_and_the_warning(cli, job):
    _, out, _ = cli(job(M3_LINE), *SETTINGS, "--json", "-")
    report = json.loads(out)
    laser = report["laser"]
    assert laser["length_mm"] == pytest.approx(100, abs=0.01) == laser["constant_power_mm"]
    assert laser["slow_mm"] == pytest.approx(3.5, abs=0.35) and laser["limit"] == 1.2
    assert laser["worst"]["line"] == 2 and laser["worst"]["position_mm"] == {"X": 0.0, "Y": 0.0, "Z": 0.0}
    assert laser["worst"]["times"] > 5
    assert [text for text in report["warnings"] if "constant power" in text]
    _, out, _ = cli(job("G1X9F600\n"), "--json", "-")
    assert json.loads(out)["laser"] is None


def test_the_power_of_the_laser_needs_a_picture(cli, job, tmp_path):
    code, _, err = cli(job(M3_LINE), "--laser-w", "5")
    assert code == 2 and "--laser-w" in err and "--plot" in err
    code, _, err = cli(job(M3_LINE), "--laser-w", "0", "--plot", tmp_path / "p.png")
    assert code == 2 and "laser-w" in err and not (tmp_path / "p.png").exists()
    code, _, _ = cli(job(M3_LINE), *SETTINGS, "--laser-w", "5", "--plot", tmp_path / "p.png")
    assert code == 0 and (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_check_has_it_as_a_finding(job, capsys):
    path = job(M3_LINE)
    with pytest.raises(SystemExit) as ended:
        main(["check", str(path), "--machine", "shapeoko3", *SETTINGS, "--json"])
    report = json.loads(capsys.readouterr().out)
    assert ended.value.code in (0, None)
    found = [finding for finding in report["findings"] if finding["kind"] == "laser-energy"]
    assert [(f["severity"], f["first_line"], f["last_line"]) for f in found] == [("warning", 2, 2)]
    assert "constant power" in found[0]["message"] and "M4" in found[0]["hint"]
