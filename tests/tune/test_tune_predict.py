"""The simulated mass against the closed forms of moves, and the prediction against the shapers' own formula."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from wificnc.errors import JobError, UserError
from wificnc.tune.choice import Mode
from wificnc.tune.mass import response_mm, vibrations
from wificnc.tune.motion import REST_S, AxisMotion, Trace, read_trace
from wificnc.tune.predict import PredictOptions, predict
from wificnc.tune.shapers import EI, OFF, SHAPERS, ZV, Impulses, impulses

A, V, D = 500.0, 20.0, 10.0  # a trapezoid: mm/s2, mm/s, mm
NONE = Impulses((1.0,), (0.0,))


def trapezoid(steps_per_mm: float) -> AxisMotion:
    """The steps of an ideal trapezoid, each at the instant at which the position is reached."""
    place = np.arange(1, round(D * steps_per_mm) + 1) / steps_per_mm
    ramp_s, ramp_mm, end_s = V / A, V**2 / (2 * A), D / V + V / A
    slowing = end_s - np.sqrt(np.maximum(0.0, 2 * (D - place) / A))
    t_s = np.where(place < ramp_mm, np.sqrt(2 * place / A), np.minimum(ramp_s + (place - ramp_mm) / V, slowing))
    t_s = np.where(place > D - ramp_mm, slowing, t_s)
    t_ns = np.round(t_s * 1e9).astype(np.uint64)
    masks = np.ones(len(t_ns), dtype=np.uint8)
    motion = Trace(
        np.append(np.uint64(0), t_ns), np.append(np.uint8(2), masks), np.zeros(len(t_ns) + 1, np.uint8)
    ).axis(0, steps_per_mm)
    assert motion is not None
    return motion


def closed_form_um(mode: Mode) -> tuple[float, float]:
    """Largest deflection after the stop, and at constant speed: z' = l z - a, solved over each phase."""
    omega = 2 * math.pi * mode.hz
    pole = complex(-mode.damping * omega, omega * math.sqrt(1 - mode.damping**2))

    def phase(z: complex, a: float, seconds: float) -> complex:
        grown = np.exp(pole * seconds)
        return complex(grown * z - a * (grown - 1) / pole)

    def largest(z: complex, seconds: float) -> float:
        t_s = np.linspace(0.0, seconds, 100_001)
        return float(np.max(np.abs((z * np.exp(pole * t_s)).imag / pole.imag))) * 1e3

    ramp_s, cruise_s = V / A, D / V - V / A
    after_ramp = phase(0j, A, ramp_s)
    return largest(phase(phase(after_ramp, 0.0, cruise_s), -A, ramp_s), 1.0), largest(after_ramp, cruise_s)


@pytest.mark.parametrize(
    "mode", [Mode(40.0, 0.02), Mode(33.0, 0.0), Mode(18.0, 0.1), Mode(90.0, 0.02), Mode(55.0, 0.5)]
)
def test_a_trapezoid_leaves_what_the_closed_form_says(mode):
    (found,) = vibrations(trapezoid(8000.0), NONE, [mode], A)
    rest_um, moving_um = closed_form_um(mode)
    assert found.rest_max_um == pytest.approx(rest_um, rel=0.03, abs=0.01)
    # Constant speed is recognised a few ms after it begins.
    assert (
        0.8 * moving_um * math.exp(-mode.damping * 2 * math.pi * mode.hz * 0.02)
        < found.moving_max_um
        < 1.01 * moving_um
    )


def test_the_rms_is_that_of_the_watched_time():
    """An undamped vibration: its amplitude / sqrt(2)."""
    (found,) = vibrations(trapezoid(8000.0), NONE, [Mode(33.0, 0.0)], A)
    assert found.rest_rms_um == pytest.approx(found.rest_max_um / math.sqrt(2), rel=0.01)


@pytest.mark.parametrize("shaper", SHAPERS[1:], ids=lambda shaper: shaper.name)
@pytest.mark.parametrize("factor", [0.8, 0.9, 1.0, 1.15])
def test_a_shaper_leaves_its_residual(shaper, factor):
    """Shaping is linear: after the stop the vibration is that without a shaper, times the residual's formula."""
    nominal, mass = Mode(40.0, 0.02), Mode(40.0 * factor, 0.02)
    shape = impulses(shaper, nominal.hz, nominal.damping)
    motion = trapezoid(8000.0)
    stop_s = motion.t_s[-1]

    def amplitude_um(used: Impulses) -> float:
        """Of the free vibration, reckoned at the end of the used shape."""
        t_s = np.arange(0.0, stop_s + 1.0, 1e-4)
        y_um = 1e3 * response_mm(motion, used, mass, t_s)
        omega = 2 * math.pi * mass.hz
        t = t_s - stop_s - used.duration_s
        phase = omega * math.sqrt(1 - mass.damping**2) * t
        basis = (np.stack([np.sin(phase), np.cos(phase)]) * np.exp(-mass.damping * omega * t)).T
        free = t > 0.0
        return float(np.hypot(*np.linalg.lstsq(basis[free], y_um[free], rcond=None)[0]))

    expected = shape.residual(mass.hz, mass.damping) * amplitude_um(NONE)
    assert amplitude_um(shape) == pytest.approx(expected, abs=0.01)


def test_an_axis_rests_where_it_makes_no_steps():
    """Two moves of four steps, 1 s apart: rests after each, and the position does not drift in between."""
    t_s = np.array([0.5, 0.51, 0.52, 0.53, 1.5, 1.51, 1.52, 1.53])
    masks = np.ones(8, np.uint8)
    motion = Trace((t_s * 1e9).astype(np.uint64), masks, 0 * masks).axis(0, 10.0)
    assert motion is not None
    assert motion.rest_from_s == pytest.approx([0.03, 1.03])
    assert motion.rest_to_s[0] == pytest.approx(0.99)
    times = np.array([0.0301, 0.5, 0.98, 0.995, 1.0, 1.03, 2.0])
    assert motion.at(times, NONE) == pytest.approx([0.4, 0.4, 0.4, 0.45, 0.5, 0.8, 0.8])
    assert motion.rests(times, NONE).tolist() == [True, True, True, False, False, True, True]
    late = Impulses((0.5, 0.5), (0.0, 0.1))
    assert motion.rests(np.array([0.12, 0.14, 0.98, 1.05, 1.14]), late).tolist() == [False, True, True, False, True]
    assert REST_S > 0.01


def test_the_chunks_of_a_long_job_are_one_motion(monkeypatch):
    whole = vibrations(trapezoid(100.0), impulses(EI, 40.0, 0.02), [Mode(40.0, 0.02), Mode(36.0, 0.02)], A)
    monkeypatch.setattr("wificnc.tune.mass.CHUNK", 97)
    parts = vibrations(trapezoid(100.0), impulses(EI, 40.0, 0.02), [Mode(40.0, 0.02), Mode(36.0, 0.02)], A)
    for one, other in zip(whole, parts, strict=True):
        assert other.rest_max_um == pytest.approx(one.rest_max_um) and other.rest_rms_um == pytest.approx(
            one.rest_rms_um
        )


# ---- jobs ----

BENCH = ("--set", "$100=800", "--set", "$101=800", "--set", "$110=6000", "--set", "$111=6000", "--set", "$120=500",
         "--set", "$121=500")  # fmt: skip
JOB = "G21 G90\nG1 X10 F1200\nG4 P0.5\nG1 Y10 F1200\nG4 P0.5\nM2\n"


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "job.nc"
    path.write_text(JOB)
    return path


def test_a_job_is_predicted(tune, job):
    """The simulator's steps: close to the ideal trapezoid, and every shaper near its formula."""
    code, out, _ = tune("predict", job, "--hz", "x=40", "--hz", "y=33", "--damping", "0.02", *BENCH, "--json")
    report = json.loads(out)
    assert code == 0 and list(report["axes"]) == ["x", "y"]
    for axis, hz in (("x", 40.0), ("y", 33.0)):
        found = {row["shaper"]: row for row in report["axes"][axis]["shapers"]}
        assert found["off"]["rest_max_um"] == pytest.approx(closed_form_um(Mode(hz, 0.02))[0], rel=0.2)
        assert found["ZV"]["rest_max_um"] < 0.02 * found["off"]["rest_max_um"]
        assert found["EI"]["rest_max_um"] == pytest.approx(0.047 * found["off"]["rest_max_um"], rel=0.1)
        assert found["ZV"]["rounding_mm"] == pytest.approx(500.0 / 8 / (2 * hz) ** 2, rel=0.01)
    assert report["settings"]["shaper_hz.x"] == 40.0 and report["settings"]["shaper_hz.y"] == 33.0
    assert report["settings"]["shaper.x"] == 2  # MZV, for 10 %
    _, out, _ = tune("predict", job, "--hz", "40", "--damping", "0.02", "--spread", "3", *BENCH)
    assert out.splitlines()[-1] == "$170=1 $180=40.00 $190=0.020 $171=1 $181=40.00 $191=0.020"


def test_a_trace_is_the_same_as_its_job(tune, job, tmp_path):
    _, expected, _ = tune("predict", job, "--hz", "40", *BENCH, "--json")
    for suffix in ("npz", "csv"):
        trace = tmp_path / f"trace.{suffix}"
        assert tune.main("sim", job, "--trace", trace, *BENCH)[0] == 0
        code, out, _ = tune("predict", trace, "--hz", "40", *BENCH, "--json")
        assert code == 0 and json.loads(out)["axes"] == json.loads(expected)["axes"]


def test_a_direction_is_seen(tmp_path, tune, job):
    trace = tmp_path / "trace.npz"
    job.write_text("G1 X5 F1200\nG1 X-3\nG1 X1\n")
    assert tune.main("sim", job, "--trace", trace, "--set", "$3=1", *BENCH)[0] == 0
    motion = read_trace(trace).axis(0, 800.0)
    assert motion is not None
    assert (motion.mm[0], max(motion.mm), min(motion.mm), motion.mm[-1]) == pytest.approx(
        (0.0, 5.0, -3.0, 1.0), abs=0.02
    )


def test_a_machine_that_vibrates_less_than_its_steps_needs_no_shaper(tune, job):
    code, out, _ = tune("predict", job, "--hz", "x=150", *BENCH, "--set", "$120=5", "--set", "$100=40")
    assert code == 0 and "recommended: off" in out and out.splitlines()[-1].startswith("$170=0 ")


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_the_picture(tune, job, tmp_path, suffix):
    path = tmp_path / f"after.{suffix}"
    code, _, err = tune("predict", job, "--hz", "40", "--damping", "0", *BENCH, "--plot", path)
    assert code == 0 and f"wrote {path}" in err
    assert path.read_bytes()[:5] in (b"\x89PNG\r", b"<?xml")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--hz", "4"), "a vibration of 4 Hz: the shapers take 5 to 200 Hz"),
        (("--hz", "1000"), "1000 Hz"),
        (("--hz", "40", "--damping", "1"), "a damping ratio of 1: the shapers take 0 to 0.5"),
        (("--hz", "q=40"), "must be a number, or like x=41.3"),
        (("--hz", "40", "--hz", "30"), "all axes given twice"),
        (("--hz", "x=40", "--damping", "y=0.1"), "this axis has no --hz"),
        (("--hz", "40", "--set", "$80=1"), "motors are its axes"),
        (("--hz", "40", "--plot", "a.gif"), "supported formats"),
        (("--hz", "40", "--send"), "--send needs a controller"),
    ],
)
def test_wrong_words_are_refused(tune, job, words, said):
    code, out, err = tune("predict", job, *words)
    assert code == 2 and said in " ".join(err.split()) and out == ""


def test_wrong_files_are_refused(tmp_path, tune, job):
    trace = tmp_path / "trace.npz"
    trace.write_bytes(b"no trace")
    with pytest.raises(UserError, match="does not say its steps per mm"):
        predict(PredictOptions(trace, {"": Mode(40.0, 0.02)}))
    for content in (b"no trace", b""):
        trace.write_bytes(content)
        with pytest.raises(JobError, match="is not a trace"):
            predict(PredictOptions(trace, {"": Mode(40.0, 0.02)}, settings=("$100=80",)))
    job.write_text("G1 X1\n")
    code, _, err = tune("predict", job, "--hz", "40")
    assert code == 1 and "error:22" in err
    job.write_text("G4 P0.1\n")
    assert tune("predict", job, "--hz", "40")[0] == 1
    job.write_text("G0 X1\n")
    code, _, err = tune("predict", job, "--hz", "y=40")
    assert code == 1 and "no axis with a frequency moves" in err
    assert tune("predict", tmp_path / "none.nc", "--hz", "40")[0] == 1


def test_off_is_the_first_and_zv_the_second():
    assert SHAPERS[:2] == (OFF, ZV)
