"""`wificnc sim --at`: hands at the virtual machine, exact in virtual time."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.errors import UserError
from wificnc.simulator.job import At, JobRequest, SimResult, Timing, run_job
from wificnc.simulator.library import Tasks
from wificnc.simulator.run import parse_at

TIMING = Timing(20_000_000, 2500, 1000, 500_000, 3)
SETTINGS = tuple(
    f"${first + axis}={value}" for first, value in ((100, 250), (110, 5000), (120, 500)) for axis in range(3)
)
JOB = "G1F1200X20Y7\nG2X30Y17I10\nM3S100\nG4P.2\nG0X1Y-2Z-3\nG1Z0\n"
END = (250, -500, 0)


def run(library, *events: tuple[float, str], text: str = JOB, settings: tuple[str, ...] = ()) -> SimResult:
    return run_job(
        library,
        JobRequest("job.nc", text.encode(), TIMING, (*SETTINGS, *settings), events=tuple(At(*e) for e in events)),
    )


@pytest.fixture(scope="module")
def plain_s(library) -> float:
    return run(library).job_time_s


@pytest.mark.parametrize("pair", [("hold", "resume"), ("feed-hold", "start"), ("safety-door", "start")])
@pytest.mark.parametrize("moment", [0.0, 0.013, 0.4, 1.111, 1.9, 2.4])
def test_held_and_resumed(library, plain_s: float, moment: float, pair: tuple[str, str]) -> None:
    """Hold and resume: the same final position, later by the pause, and no pulse more."""
    result = run(library, (moment, pair[0]), (moment + 3, pair[1]))
    assert result.errors == () and result.warnings in ((), ("Check Door",))
    assert result.final_position_steps == END
    assert result.job_time_s > plain_s + 2.5
    assert [event.done for event in result.events] == [True, True]
    assert result.events[0].state.split(":")[0] in ("Hold", "Door")
    assert result.steps_per_axis == run(library).steps_per_axis


@pytest.mark.parametrize("tasks", list(Tasks))
@pytest.mark.parametrize("moment", [0.0137, 0.4, 1.111])
def test_a_button_is_pressed_as_long_as_by_a_finger(library, plain_s: float, moment: float, tasks: Tasks) -> None:
    """However rarely the board's tasks look: each press counts, and once."""
    events = (At(moment, "feed-hold"), At(moment + 3, "start"))
    result = run_job(library, JobRequest("job.nc", JOB.encode(), replace(TIMING, tasks=tasks), SETTINGS, events=events))
    assert result.errors == () and result.final_position_steps == END
    assert plain_s + 2.5 < result.job_time_s < plain_s + 3.5


@pytest.mark.parametrize("moment", [0.0501, 0.3337, 1.0, 2.222])
def test_estop(library, moment: float) -> None:
    """No step leaves the pins after it: position = pulses, and it is where it was at that moment."""
    result = run(library, (moment, "estop"), (moment + 1, "estop off"), (moment + 2, "reset"))
    alarm, *under_way = [error.message for error in result.errors]
    assert alarm.startswith("ALARM:50")
    assert all(message.startswith("locked by an alarm") for message in under_way)  # each line has its answer
    first, off, reset = result.events
    assert (first.time_s, first.state, reset.state) == (moment, "Alarm", "Alarm")
    # run_job() itself holds the counters against the pulses of the pins
    assert first.position_steps == off.position_steps == reset.position_steps == result.final_position_steps
    assert result.final_position_steps != END


def test_the_moment_is_exact(library) -> None:
    """At constant speed the position at t and at t + 1 ms differ by v t, to the step, wherever t is."""
    moments = [0.5, 0.501, 0.7, 0.70005]
    result = run(library, *((t, "probe on") for t in moments), text="G1X100F6000\n", settings=("$110=6000",))
    x = [event.position_steps[0] for event in result.events]
    for (t0, x0), (t1, x1) in zip(zip(moments, x, strict=True), list(zip(moments, x, strict=True))[1:], strict=False):
        assert x1 - x0 == pytest.approx((t1 - t0) * 100 * 250, abs=1)


def test_a_limit_switch(library) -> None:
    """$21: alarm 1 immediately; without $21 the job ends where it should."""
    result = run(library, (0.5, "limit x"), settings=("$21=1",))
    assert result.errors[0].message.startswith("ALARM:1")
    assert result.final_position_steps == result.events[0].position_steps
    assert run(library, (0.5, "limit x"), (0.6, "limit x off")).final_position_steps == END


def test_ends_of_travel_and_surface(library) -> None:
    """What a hand prepares at 0 s is there before the first step."""
    result = run(library, (0, "travel x -10 10"), settings=("$21=1",))
    assert result.errors[0].message.startswith("ALARM:1") and result.final_position_steps[0] == 2500
    probe = run(library, (0, "surface -5.2"), text="G38.2Z-20F300\n")
    assert probe.errors == () and -1325 < probe.final_position_steps[2] <= -1300  # stops behind the contact


def test_a_reset_at_rest_ends_the_job(library) -> None:
    """In a hold a reset is no alarm; what was not yet read of the job is gone, and it says where."""
    result = run(library, (0.3, "hold"), (2, "soft-reset"))
    assert "reset" in result.errors[-1].message or "ALARM:3" in result.errors[-1].message
    assert result.events[1].done and result.final_position_steps == result.events[1].position_steps


def test_a_hold_without_an_end(library) -> None:
    result = run(library, (0.3, "hold"))
    assert [error.message for error in result.errors] == ["the job is held here, and no event resumes it"]


def test_overrides(library, plain_s: float) -> None:
    """Feed 200 % is faster, rapid 25 % slower, and the path is the same."""
    fast = run(library, *[(0, "feed +10")] * 10)
    slow = run(library, (0, "rapid 25"), (0, "spindle -10"), (0, "flood"))
    assert fast.final_position_steps == slow.final_position_steps == END
    assert fast.job_time_s < plain_s < slow.job_time_s


def test_a_gantry_that_cannot_be_squared(library) -> None:
    """Alarm 10 from a board with two motors on Y; `$H` is in the file."""
    timing = Timing(20_000_000, 2500, 1000, 500_000, 3, ganged=2)
    request = JobRequest(
        "home.nc",
        b"$H\n",
        timing,
        (*SETTINGS, "$22=1", "$25=2000"),
        events=(*(At(0, f"travel {axis} -300 20") for axis in "xyz"), At(0.001, "skew y -40")),
    )
    assert [error.message.split()[0] for error in run_job(library, request).errors] == ["ALARM:10"]


def test_what_comes_too_late_is_told(library) -> None:
    result = run(library, (500, "reset"))
    assert result.errors == () and result.warnings == ("the job ended before 500 s: reset",)
    assert not result.events[0].done and result.final_position_steps == END


def test_events_are_done_in_the_order_of_their_times(library) -> None:
    result = run(library, (1.5, "start"), (0.5, "hold"), (0.5, "probe"))
    assert [(event.time_s, event.action) for event in result.events] == [
        (0.5, "hold"),
        (0.5, "probe"),
        (1.5, "start"),
    ]
    assert result.final_position_steps == END


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("2.5s limit x", At(2.5, "limit x")),
        (" 300 ms  HOLD ", At(0.3, "hold")),
        ("2min travel X  -1 2", At(120.0, "travel x -1 2")),
    ],
)
def test_times(text: str, event: At) -> None:
    assert parse_at(text) == event


@pytest.mark.parametrize("text", ["hold", "2 hold", "s hold", "-1s hold", "1s", "", "1h hold"])
def test_no_times(text: str) -> None:
    with pytest.raises(UserError, match="has no time"):
        parse_at(text)


@pytest.mark.parametrize("words", ["lift", "door ajar", "travel q 1 2", "hold on tight", "feed 37", "x" * 200])
def test_words_that_mean_nothing_are_refused_before_the_run(library, words: str) -> None:
    with pytest.raises(UserError, match=r"at 1\.25 s"):
        run(library, (1.25, words))


def test_the_command(job, tmp_path: Path) -> None:
    """--json has every event with its time, the state after it and the position then."""
    out = tmp_path / "out.json"
    words = ["--at", "300ms hold", "--at", "1.3s resume", "--json", str(out)]
    done = CliRunner().invoke(root, ["sim", str(job("G1X10F1200\n")), *words])
    assert done.exit_code == 0, done.output
    events = json.loads(out.read_text())["events"]
    assert [(e["time_s"], e["action"], e["done"], e["state"]) for e in events] == [
        (0.3, "hold", True, "Hold:1"),
        (1.3, "resume", True, "Run"),
    ]
    assert 0 < events[0]["position_steps"]["X"] < events[1]["position_steps"]["X"] < 10 * 250
