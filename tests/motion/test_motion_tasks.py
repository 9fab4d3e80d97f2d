"""Motion in the task periods of the boards, and with sides of the firmware that stall."""

from __future__ import annotations

import numpy as np
import pytest
from monitor import CHECKS, Checks
from motion_host import BASELINE, Host
from stalls import SIDES, Side
from wificnc.simulator.library import Tasks

BOARDS = (Tasks.ESP32, Tasks.PIC32MZ)


def controller(tasks: Tasks, checks: Checks = CHECKS) -> Host:
    host = Host(tasks=tasks, checks=checks)
    host.settings(**BASELINE, s11=0.01, s12=0.002)
    return host


@pytest.mark.parametrize("tasks", BOARDS)
@pytest.mark.parametrize("feed", [40, 60, 100, 170, 250, 1000, 5000])
def test_a_move_never_waits_for_its_spans(tasks: Tasks, feed: int) -> None:
    host = controller(tasks)
    run = host.run(f"G1 X1 F{feed}\n")
    assert run.answers == ["ok"] and run.counted() == run.position
    assert run.counters.underruns == 0
    host.close()


@pytest.mark.parametrize("tasks", BOARDS)
def test_the_steps_of_a_cruise_are_even_in_the_periods_of_a_board(tasks: Tasks) -> None:
    """100 mm/min at 250 steps/mm is a step each 2.4 ms, whichever task looks when."""
    host = controller(tasks)
    run = host.run("G1 X2 F100\n")
    seconds = run.seconds()
    cruise = seconds[(seconds > seconds[0] + 0.1) & (seconds < seconds[-1] - 0.1)]
    assert len(cruise) > 300
    assert np.abs(np.diff(cruise) - 0.0024).max() <= 5e-6
    host.close()


@pytest.mark.parametrize("tasks", BOARDS)
def test_a_board_makes_the_steps_of_a_controller_that_always_looks(tasks: Tasks) -> None:
    program = "G1 X3 Y1 F1200\nG2 X5 Y3 I1 J1\nG0 Z-2\nG4 P0.05\nG1 X0 Y0 Z0 F3000\n"
    runs = []
    for of in (Tasks.FREE, tasks):
        host = controller(of)
        runs.append(host.run(program))
        host.close()
    free, board = runs
    assert board.counters.underruns == 0
    assert board.position == free.position and board.counted() == board.position
    assert (board.positions()[:, 0] == free.positions()[:, 0]).all()


@pytest.mark.parametrize("tasks", [Tasks.FREE, *BOARDS])
@pytest.mark.parametrize("side", SIDES)
def test_a_stall_loses_no_step_and_no_line(tasks: Tasks, side: Side) -> None:
    host = controller(tasks, CHECKS)
    host.stall(side, 0.05, 0.4)
    host.stall(side, 0.6, 1.0)
    run = host.run("G1 X3 F1200\nY2\nX0 Y0\n" * 4)
    assert run.answers == ["ok"] * 12
    assert run.position == [0] * 6 and run.counted() == run.position
    host.close()


DENSE = {
    "empty lines": "\n" * 1900,
    "comments": "(x)\n" * 480,
    "settings that are read": "$G\n" * 400,
    "micro moves": "".join(f"G1X{n * 0.005:.3f}Y{n % 2 * 0.003:.3f}F12000\n" for n in range(1200)),
    "short arcs": "".join(f"G2X{n * 0.02:.2f}I0.01F12000\n" for n in range(1, 400)),
    "a restarted ESP32's micro moves": "G1F12000\n" + "".join(f"X{n * 0.005:.3f}\n" for n in range(1, 3784)),
    "a restarted ESP32's empty lines": "\n" * 13_715,
    "messages": "(DEBUG,x=#<_x>)\n" * 1000,
    "computed lines": "".join(f"G1X[{n}*0.01+SIN[0]]F6000\n" for n in range(1, 500)),
    "lists of settings": "$$\n" * 20,
    "stored settings": "".join(f"$110={1000 + n}\n" for n in range(50)),
    "outputs between moves": "".join(f"G1X{n * 0.05:.2f}F12000\nM8\nM9\n" for n in range(200)),
}


@pytest.mark.parametrize("program", DENSE.values(), ids=DENSE.keys())
def test_tasks_rest_whatever_waits(program: str) -> None:
    """The monitor counts rounds without a rest; each line is executed all the same."""
    host = controller(Tasks.ESP32)
    run = host.run(program)
    assert run.answers.count("ok") == program.count("\n")
    assert run.counted() == run.position
    host.close()


def test_the_step_interrupt_goes_on_while_the_task_is_stalled() -> None:
    host = controller(Tasks.ESP32, CHECKS)
    host.start("G1 X10 F600\n")
    host.until(host.ticks() + 2_000_000)
    steps, ticks = host.counters().step_events, host.ticks()
    host.stall(Side.CONTROLLER, 0, 0.002)
    host.until(ticks + 40_000)
    assert host.counters().step_events > steps + 3
    run = host.settle()
    assert run.position[0] == 2500 and run.counted() == run.position
    host.close()


def test_a_stalled_controller_answers_when_it_is_back() -> None:
    host = controller(Tasks.FREE)
    host.start("")
    host.stall(Side.CONTROLLER, 0, 0.3)
    begin = host.ticks()
    assert "Idle" in host.status()
    assert host.ticks() - begin == pytest.approx(0.3 * host.timer_hz, abs=2)
    host.close()


@pytest.mark.parametrize("tasks", [Tasks.FREE, *BOARDS])
@pytest.mark.parametrize("seed", range(1, 5))
def test_random_stalls_lose_nothing_and_are_repeatable(tasks: Tasks, seed: int) -> None:
    runs = []
    for _ in range(2):
        host = controller(tasks, CHECKS)
        host.stall_randomly(seed, gap_ms=60, longest_ms=200)
        runs.append(host.run("G1 X3 F1200\nY2\nG4 P0.01\nX0 Y0\n" * 8))
        host.close()
    assert runs[0].answers == ["ok"] * 32
    assert runs[0].position == [0] * 6 == runs[0].counted()
    assert (runs[0].events == runs[1].events).all()
