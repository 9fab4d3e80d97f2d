"""The interrupt handlers of the real image: what they may do, and how long they take."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from chip_controller import Controller
from mips.isr import PROBING, SELDOM, Program, disassemble, longest_path, read_disassembly, violations
from wificnc.build.pic32mz import Pic32Build

ROOT = Path(__file__).resolve().parents[2]

BUDGET = json.loads((ROOT / "tests" / "budget" / "pic32mz.json").read_text())
IRQ_OC1, IRQ_T4 = 7, 19


@pytest.fixture(scope="module")
def program(build: Pic32Build) -> Program:
    return read_disassembly(disassemble(build.elf))


def test_handlers_keep_their_rules(program: Program) -> None:
    assert violations(program) == []


def test_longest_paths_keep_their_budget(program: Program) -> None:
    found = {
        "step within a span, late and turning, at most": longest_path(program, "_vector_step", SELDOM),
        "step that ends a span, late and turning, at most": longest_path(program, "_vector_step", [PROBING]),
        "step that ends a span as the probe closes, at most": longest_path(program, "_vector_step"),
        "end of a pulse with a new direction, at most": longest_path(program, "_vector_pulse_end"),
    }
    over = {name: count for name, count in found.items() if not 0 < count <= BUDGET[name]}
    assert not over


def test_means_keep_their_budget(controller: Controller) -> None:
    """Four axes at the same time, span ends and waits among them."""
    controller.fine("G91G1X30Y20Z10A5F3000")
    controller.rest()
    for name, irq in (("step, mean", IRQ_T4), ("end of a pulse, mean", IRQ_OC1)):
        vector = controller.chip.vector(irq)
        assert vector.count > 7500 and vector.instructions / vector.count <= BUDGET[name], name
