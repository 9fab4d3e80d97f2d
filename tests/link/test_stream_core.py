"""The streamer against the real core: nothing is lost, nothing overruns, and errors are reported line by line."""

from __future__ import annotations

import pytest
from core_bridge import FAST, Bridge
from sender import Nobody, Notes, advertised, run_job, talk
from wificnc.connection.client import Client, connected
from wificnc.job.fate import fate_lines
from wificnc.job.run import End, Progress, RunOptions

STEPS_PER_MM = 250


def zigzag(lines: int, reach_mm: float = 20.0) -> str:
    """Ends at X = lines/1000 mod reach."""
    moves = [f"G1 X{(i * 37 % 200) / 10:.3f} Y{(i * 11 % 150) / 10:.3f} (move {i})" for i in range(lines)]
    return "\n".join(["%", "G21 G90", "F6000", *moves, "G0 X1.5 Y2.25 Z-3", "M2", "%"]) + "\n"


@pytest.mark.parametrize("rx_bytes", [40, 128, 1024])
def test_every_line_is_answered_and_the_buffer_is_never_overrun(bridge: Bridge, client: Client, rx_bytes: int) -> None:
    outcome = run_job(client, zigzag(400), advertised(rx_bytes))
    assert (outcome.end, outcome.detail, outcome.errors) == (End.FINISHED, "", ())
    assert outcome.sent == outcome.answered == outcome.lines == 404
    assert bridge.position_steps()[:3] == [375, 563, -750]
    assert bridge.overruns == 0
    assert rx_bytes * 0.5 < bridge.most_bytes <= rx_bytes


def test_what_the_controller_advertises_and_reports_as_free() -> None:
    with Bridge(settings=FAST + "$10=3\n") as bridge, talk(bridge) as client:
        options = client.options()
        assert options
        outcome = run_job(client, zigzag(2000), RunOptions(options))
        assert outcome.complete
        assert outcome.planner_blocks == options.planner_blocks > 0
        assert bridge.overruns == 0
        assert options.rx_bytes // 2 < bridge.most_bytes <= options.rx_bytes


def test_alarm_in_the_middle_of_a_job() -> None:
    limits = "$22=1\n$20=1\n$130=30\n$131=30\n$132=30\n"
    with Bridge(settings=FAST + limits) as bridge, connected(bridge.target) as client:
        client.synchronise()
        if client.now().status.state == "Alarm":
            client.must("$X")
        outcome = run_job(client, "G21\nG90\nG0 X-1\nG0 X-2\nG0 X-500\nG0 X-3\n")
        assert (outcome.end, outcome.detail) == (
            End.ALARM,
            "ALARM:2 the target is outside the travel; the position is valid",
        )
        assert outcome.last_answered is not None
        assert outcome.last_answered.number == 4
        assert outcome.unanswered[0].number == 5


def test_comments_never_reach_the_controller(bridge: Bridge, client: Client) -> None:
    text = "G0 X1 (what? stop! ~ \x18 ü “quoted”)\n; all ! comment ?\nG0 (a) Y1\n"
    outcome = run_job(client, text)
    assert outcome.complete
    assert bridge.lines == ["G0X1", "G0Y1"]


def test_error_stops_the_job_and_keeps_the_position(bridge: Bridge, client: Client) -> None:
    text = zigzag(50).replace("(move 20)", "(move 20) K1")
    notes = Notes()
    outcome = run_job(client, text, advertised(128), notes=notes)
    assert outcome.end is End.ERROR
    (error,) = notes.errors[:1]
    assert error.line.number == 24
    assert error.title("job.nc") == "job.nc:24: error:36 the line has words that no command uses"
    assert "(move 20) K1" in error.line.text
    assert outcome.sent < outcome.lines
    assert client.look().state == "Idle"  # held before it was reset: no ALARM:3


def test_keep_going_collects_all_errors(bridge: Bridge, client: Client) -> None:
    text = zigzag(50).replace("(move 20)", "K1").replace("(move 30)", "G77")
    options = advertised(128)
    options.keep_going = True
    outcome = run_job(client, text, options)
    assert outcome.end is End.FINISHED
    assert [(error.line.number, error.code) for error in outcome.errors] == [(24, 36), (34, 20)]
    assert not outcome.complete
    assert bridge.position_steps()[:3] == [375, 563, -750]


def test_operator_goes_on_after_an_error(bridge: Bridge, client: Client) -> None:
    keys = Nobody(interactive=True)

    def answer(progress: Progress) -> None:
        if "refused" in progress.question:
            keys.pressed = "c"

    text = zigzag(50).replace("(move 20)", "K1")
    outcome = run_job(client, text, advertised(128), keys, Notes(answer))
    assert outcome.end is End.FINISHED
    assert [error.line.number for error in outcome.errors] == [24]
    assert bridge.position_steps()[:3] == [375, 563, -750]


def test_operator_stops_after_an_error(bridge: Bridge, client: Client) -> None:
    keys = Nobody(interactive=True)
    questions = []

    def answer(progress: Progress) -> None:
        if progress.question and "x: stop" in progress.question:
            questions.append(progress.question)
            keys.pressed = "x"

    outcome = run_job(client, zigzag(50).replace("(move 20)", "K1"), advertised(128), keys, Notes(answer))
    assert outcome.end is End.ERROR
    assert "line 24 (G1 X14.000 Y7.000 K1)" in questions[0]
    assert client.look().state == "Idle"


def test_reset_in_the_middle_of_a_job(bridge: Bridge, client: Client) -> None:
    bridge.slow_after(20)
    bridge.reset_while_lines_wait(answered=60, waiting=3)
    outcome = run_job(client, zigzag(400), advertised(128))
    assert outcome.end is End.RESET
    assert "while the machine moved" in outcome.detail
    assert outcome.last_answered is not None
    assert 60 <= outcome.answered <= len(bridge.answers)  # a reset may bring an ok of its own, behind the alarm
    assert outcome.last_answered.number == outcome.answered + 1
    assert outcome.unanswered[0].number == outcome.last_answered.number + 1
    assert outcome.sent - outcome.answered == len(outcome.unanswered)
    words = fate_lines(outcome)
    assert words[1].startswith(f"Last line acknowledged: line {outcome.answered + 1} (G1 X")
    assert words[2].startswith(f"Sent and not acknowledged: line {outcome.answered + 2} (G1 X")


def test_lost_link_in_the_middle_of_a_job(bridge: Bridge, client: Client) -> None:
    bridge.slow_after(20)
    bridge.at_answer(60, bridge.drop)
    outcome = run_job(client, zigzag(400), advertised(128))
    assert outcome.end is End.LINK_LOST
    assert 1 <= outcome.answered <= 60
    assert outcome.last_answered is not None
    first = outcome.answered + 2
    assert outcome.last_answered.number == first - 1
    assert [line.number for line in outcome.unanswered] == list(range(first, first + len(outcome.unanswered)))
    assert "They may still be executed" in fate_lines(outcome)[2]


def test_hold_and_resume_by_keys(bridge: Bridge, client: Client) -> None:
    keys = Nobody(interactive=True)
    states = []

    def press(progress: Progress) -> None:
        state = progress.snapshot.status.state
        if progress.answered >= 20 and "Hold" not in states:
            keys.pressed = "!"
        states.append(state)
        if state == "Hold":
            keys.pressed = "~"

    bridge.slow_after(20)
    outcome = run_job(client, zigzag(400), advertised(128), keys, Notes(press))
    assert outcome.complete
    assert "Hold" in states
    assert bridge.position_steps()[:3] == [375, 563, -750]


def test_program_pause_says_what_the_program_says(bridge: Bridge, client: Client) -> None:
    keys = Nobody(interactive=True)
    notes = Notes(lambda p: setattr(keys, "pressed", "~" if p.snapshot.status.state == "Hold" else ""))
    outcome = run_job(client, "G0 X1\nM0 (turn the part over)\nG0 X2\n", keys=keys, notes=notes)
    assert outcome.complete
    assert "line 2 (M0 (turn the part over)): the program pauses; ~ resumes" in notes.messages
    assert bridge.position_steps()[0] == 2 * STEPS_PER_MM


def test_dollar_line_waits_until_nothing_moves(bridge: Bridge, client: Client) -> None:
    outcome = run_job(client, "G0 X30\n$110=15000\nG0 X0\n")
    assert outcome.complete  # sent while moving it would be error:8


def test_second_ctrl_c_resets_at_once(bridge: Bridge, client: Client) -> None:
    keys = Nobody(interactive=True)
    pressed: list[str] = []

    def press(progress: Progress) -> None:
        if progress.answered >= 20 and len(pressed) < 2:
            pressed.append(progress.question)
            keys.pressed = "\x03"

    bridge.slow_after(20)
    outcome = run_job(client, zigzag(400), advertised(128), keys, Notes(press))
    assert (outcome.end, outcome.detail) == (End.STOPPED, "reset by the operator")
    assert "Feed hold." in pressed[1]


def test_ctrl_c_without_a_terminal_holds_and_resets(bridge: Bridge, client: Client) -> None:
    keys = Nobody()
    bridge.slow_after(20)
    outcome = run_job(
        client, zigzag(400), advertised(128), keys,
        Notes(lambda p: setattr(keys, "pressed", "\x03" if p.answered >= 20 else "")),
    )  # fmt: skip
    assert outcome.end is End.STOPPED
    assert client.look().state == "Idle"
