"""The ESP32's firmware as Xtensa code: both chips compile, and the interrupt handlers keep their rules."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path

import pytest
from xtensa.compile import compile_all, firmware_sources
from xtensa.headers import BOARDS, small_headers
from xtensa.isr import Program, firmware_in_ram, interrupt_program, step_interrupt, violations
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain

ROOT = Path(__file__).resolve().parents[2]
BUDGET = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())


@pytest.fixture(scope="module")
def tools() -> Toolchain:
    try:
        return find_toolchain()
    except NoToolchainError as err:
        pytest.skip(str(err))


@cache
def program_of(chip: str) -> Program:
    tools = find_toolchain()
    output = ROOT / "build" / "xtensa" / "small" / chip
    sources = firmware_sources(ROOT)
    objects = compile_all(tools, ROOT, small_headers(ROOT, chip, output), sources, output)
    assert not [(made.source.name, made.said) for made in objects if made.said]
    return interrupt_program(tools, ROOT, output, sources)


@pytest.mark.parametrize("chip", BOARDS)
def test_every_file_compiles_and_interrupts_keep_their_rules(tools: Toolchain, chip: str) -> None:
    assert violations(program_of(chip), firmware_in_ram(ROOT)) == []


@pytest.mark.parametrize("chip", BOARDS)
def test_the_step_interrupt_keeps_its_budget(tools: Toolchain, chip: str) -> None:
    found = step_interrupt(program_of(chip))
    over = {name: count for name, count in found.items() if not 0 < count <= BUDGET[name]}
    assert not over


def test_headers_of_our_own_are_small() -> None:
    """They declare what is used; they are no copy of somebody's."""
    lines = sum(len(path.read_text().splitlines()) for path in (ROOT / "targets/esp32/test/idf_api").rglob("*.h"))
    assert lines < 1000


def test_ci_machines_without_a_compiler_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "PATH", "/nowhere")
    with pytest.raises(NoToolchainError, match="apt-get install"):
        find_toolchain.__wrapped__()
