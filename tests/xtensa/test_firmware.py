"""The ESP32's firmware as Xtensa code: both chips compile, and the interrupt handlers keep their rules."""

from __future__ import annotations

import json
import os
import re
from functools import cache
from pathlib import Path

import pytest
from slow import deep_but
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc_chips.esp32 import RADIO_MARK
from xtensa.compile import (
    Object,
    board_sources,
    compile_all,
    firmware_sources,
    image_bytes,
    static_ram_bytes,
    static_ram_of_board,
)
from xtensa.headers import (
    BOARDS,
    SHIFT_BOARDS,
    by_rmt,
    generate_pins,
    other_boards,
    rmt_board,
    small_headers,
    with_pins,
)
from xtensa.isr import (
    STEP,
    VECTOR,
    Program,
    firmware_in_ram,
    in_flash,
    interrupt_program,
    panic_violations,
    step_interrupt,
    violations,
)
from xtensa.stack import RESERVE, Stacks, task_stacks
from xtensa.toolchain import NoToolchainError, Toolchain, find_toolchain

pytestmark = pytest.mark.slow  # compiles all of the firmware

ROOT = Path(__file__).resolve().parents[2]
CHIPS = deep_but("esp32".__eq__, BOARDS)  # the S3 is another half a minute of compiling; test_on_chip.py runs its steps
WORDS_OF_4_US, INSTRUCTIONS_OF_A_WORD = 2, 4  # loops are counted once: each further word
BUDGET = json.loads((ROOT / "tests" / "budget" / "xtensa.json").read_text())


@cache
def objects_of(chip: str) -> list[Object]:
    output = ROOT / "build" / "xtensa" / "small" / chip
    headers = small_headers(ROOT, chip, output)
    (other,) = BOARDS.keys() - {chip}
    objects = compile_all(find_toolchain(), ROOT, headers, firmware_sources(ROOT), output, twin=output.with_name(other))
    assert not [(made.source.name, made.said) for made in objects if made.said]
    return objects


@cache
def program_of(chip: str) -> Program:
    objects_of(chip)
    output = ROOT / "build" / "xtensa" / "small" / chip
    return interrupt_program(ROOT, output, firmware_sources(ROOT))


@cache
def rmt_program_of(chip: str) -> Program:
    output = ROOT / "build" / "xtensa" / "small" / chip / "rmt"
    return board_program(rmt_board(chip, output), output)


def board_program(board: Board, output: Path) -> Program:
    headers = small_headers(ROOT, board.chip, output, board)
    objects = compile_all(find_toolchain(), ROOT, headers, board_sources(ROOT), output, kinds=("asm",))
    assert not [(made.source.name, made.said) for made in objects if made.said]
    return interrupt_program(ROOT, output, board_sources(ROOT))


@cache
def shift_program_of(chip: str) -> Program:
    return board_program(load_board(SHIFT_BOARDS[chip]), ROOT / "build" / "xtensa" / "small" / chip / "i2s")


@pytest.mark.parametrize("chip", CHIPS)
def test_every_file_compiles_and_interrupts_keep_their_rules(tools: Toolchain, chip: str) -> None:
    assert violations(program_of(chip), firmware_in_ram(ROOT)) == []


@pytest.mark.parametrize("chip", CHIPS)
def test_a_panic_needs_nothing_from_flash(tools: Toolchain, chip: str) -> None:
    """By pins, and by shift registers, whose words have to leave."""
    in_ram = firmware_in_ram(ROOT)
    assert panic_violations(program_of(chip), in_ram) == []
    assert panic_violations(shift_program_of(chip), in_ram) == []


@pytest.mark.parametrize("chip", CHIPS)
def test_the_motion_task_waits_for_no_code(tools: Toolchain, chip: str) -> None:
    """What it calls in each round lies in RAM: a line of the cache that comes from flash delays what is prepared, and
    on the ESP32-S3 core 0 replaces lines of the cache that both cores share."""
    assert in_flash(program_of(chip), firmware_in_ram(ROOT)) == []


@pytest.mark.parametrize("chip", CHIPS)
def test_the_step_interrupt_keeps_its_budget(tools: Toolchain, chip: str) -> None:
    found = step_interrupt(program_of(chip), ROOT)
    over = {name: count for name, count in found.items() if not 0 < count <= BUDGET[name]}
    assert not over


def without_second(board: Board) -> Board:
    y = board.axis.wired()["y"].model_copy(update={"second": None})
    return board.model_copy(update={"axis": board.axis.model_copy(update={"y": y})})


@pytest.mark.parametrize(
    ("engine", "board_id"),
    [
        pytest.param("gpio", "esp32s3-devkitc-gantry", marks=pytest.mark.deep),
        pytest.param("rmt", "esp32s3-devkitc-gantry", marks=pytest.mark.deep),
        pytest.param("i2s", "mks-tinybee-gantry", marks=pytest.mark.slow),
        pytest.param("spi", "esp32s3-devkitc-shift", marks=pytest.mark.deep),
    ],
)
def test_a_second_motor_costs_the_step_interrupt_nothing(tools: Toolchain, engine: str, board_id: str) -> None:
    """The same board with and without it: not an instruction more."""
    gantry = load_board(board_id)
    assert gantry.ganged_axes == 1 << 1
    found = []
    for name, board in (("two", gantry), ("one", without_second(gantry))):
        output = ROOT / "build" / "xtensa" / "small" / board.chip / f"{board_id}-{name}-{engine}"
        program = board_program(by_rmt(board, output) if engine == "rmt" else board, output)
        found.append(step_interrupt(program, ROOT))
    assert found[0] == found[1] and all(count > 0 for count in found[0].values())


def documented(row: str) -> list[int]:
    """The numbers of a row of the tables in docs/performance.md."""
    text = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {row} |")]
    cells = [cell.strip().replace(",", "").replace(" ", "") for cell in line.split("|")[2:-1]]
    return [int(cell) for cell in cells if cell.isdigit()]


ROWS = {
    "event": "a step within a span",
    "event that ends a span": "a span ends, the next is loaded, directions change",
    "event that ends a span as the probe closes": "the same, and the probe closes at this very step",
}


@pytest.mark.parametrize("chip", CHIPS)
def test_the_documents_have_the_step_interrupts_figures(tools: Toolchain, chip: str) -> None:
    """By GPIO, by the RMT of the ESP32 and of the ESP32-S3, whose board has three axes, by I2S, and the budget; by SPI
    and its own."""
    rmt, shifted = (step_interrupt(of(chip), ROOT) for of in (rmt_program_of, shift_program_of))
    gpio = step_interrupt(program_of(chip), ROOT) if chip == "esp32" else {}
    for name, row in ROWS.items():
        by_gpio, *by_rmt, by_i2s, budget, by_spi, budget_of_spi = documented(row)
        assert (budget, budget_of_spi) == (BUDGET[name], BUDGET["by SPI"][name]), row
        if chip == "esp32":
            assert (by_gpio, by_rmt[0], by_i2s) == (gpio[name], rmt[name], shifted[name]), row
        else:
            assert (by_rmt[1:], by_spi) == ([rmt[name]], shifted[name]), row


def assert_documented(row: str, found: int, budget: int) -> None:
    """To half a per cent."""
    figure, promised = documented(row)
    assert promised == budget and abs(figure - found) <= 0.005 * found, (row, found)


@pytest.mark.parametrize("chip", CHIPS)
def test_the_documents_have_the_static_ram_that_the_firmware_takes(tools: Toolchain, chip: str) -> None:
    name = {"esp32": "ESP32", "esp32s3": "ESP32-S3"}[chip]
    used = static_ram_bytes(tools, objects_of(chip))
    assert_documented(f"static RAM of core and target, {name}", used, BUDGET["static RAM"][chip])


@pytest.mark.parametrize("chips", deep_but(["esp32"].__eq__, [["esp32"], [*BOARDS]]), ids="-".join)
def test_the_documents_have_the_flash_that_the_firmware_takes(tools: Toolchain, chips: list[str]) -> None:
    """Code of the larger of both chips, which differ by less than a figure may."""
    code = max(image_bytes(tools, objects_of(chip)) for chip in chips)
    budget = BUDGET["code and constants of core and target"]
    assert_documented("code and constants of core and target in flash", code, budget)


@pytest.mark.parametrize("chip", CHIPS)
def test_static_ram_keeps_its_budget(tools: Toolchain, chip: str) -> None:
    assert 20_000 < static_ram_bytes(tools, objects_of(chip)) <= BUDGET["static RAM"][chip]


@pytest.mark.parametrize("chip", CHIPS)
def test_our_own_part_of_the_image_keeps_its_budget(tools: Toolchain, chip: str) -> None:
    assert 200_000 < image_bytes(tools, objects_of(chip)) <= BUDGET["code and constants of core and target"]


@pytest.mark.deep
@pytest.mark.parametrize("chip", CHIPS)
def test_static_ram_of_the_other_boards(tools: Toolchain, chip: str) -> None:
    objects, output = objects_of(chip), ROOT / "build" / "xtensa" / "small" / chip
    headers = small_headers(ROOT, chip, output)
    for board in other_boards(chip):
        generate_pins(board, output / board.id)
        used = static_ram_of_board(tools, ROOT, with_pins(headers, output / board.id), objects, output / board.id)
        assert 20_000 < used <= BUDGET["static RAM"][chip], board.id


@pytest.mark.parametrize("chip", CHIPS)
def test_step_pulses_by_the_rmt_keep_rules_and_budget(tools: Toolchain, chip: str) -> None:
    program = rmt_program_of(chip)
    assert violations(program, firmware_in_ram(ROOT), [STEP]) == []
    found = step_interrupt(program, ROOT)
    assert not {name: count for name, count in found.items() if not 0 < count <= BUDGET[name]}


@pytest.mark.parametrize("chip", CHIPS)
def test_steps_through_shift_registers_keep_rules_and_budget(tools: Toolchain, chip: str) -> None:
    """The SPI needs two words a step, each with five registers, so its budget is another one."""
    program, budget = shift_program_of(chip), BUDGET if chip == "esp32" else BUDGET["by SPI"]
    assert violations(program, firmware_in_ram(ROOT), [STEP]) == []
    found = step_interrupt(program, ROOT)
    assert not {name: count for name, count in found.items() if not 0 < count <= budget[name]}


@pytest.mark.parametrize("chip", CHIPS)
def test_six_axes_at_100k_through_shift_registers_take_a_quarter_of_a_core(tools: Toolchain, chip: str) -> None:
    """By instructions, one a cycle: each event as long as one that ends a span, and pulses of 4 us. The SPI has a word
    for each edge, whatever lies between them."""
    words = sum(WORDS_OF_4_US - 1 for _ in ("pulse", "pause")) if chip == "esp32" else 0
    event = step_interrupt(shift_program_of(chip), ROOT)["event that ends a span"] + words * INSTRUCTIONS_OF_A_WORD
    assert event * 100_000 <= 0.25 * 240e6


@pytest.mark.parametrize("chip", CHIPS)
def test_tasks_have_stack_enough(tools: Toolchain, chip: str) -> None:
    short = {
        task: way for task, (way, size) in task_stacks(program_of(chip), ROOT).items() if way.bytes + RESERVE > size
    }
    assert not short


@pytest.mark.parametrize("chip", CHIPS)
def test_the_vector_has_stack_enough(tools: Toolchain, chip: str) -> None:
    size = re.search(r"^stack:\n    \.space (\d+)$", (ROOT / VECTOR).read_text(), re.MULTILINE)
    assert size
    needed = Stacks(program_of(chip), 1).deepest(STEP, "targets/esp32/hal/step_interrupt.c")
    assert 0 < needed.bytes <= int(size[1]) // 2  # another compiler's frames are not these


def test_headers_of_our_own_are_small() -> None:
    """They declare what is used; they are no copy of someone's."""
    lines = sum(len(path.read_text().splitlines()) for path in (ROOT / "targets/esp32/test/idf_api").rglob("*.h"))
    assert lines < 2000  # of some 100,000


def test_headers_of_our_own_declare_only_what_is_used() -> None:
    """By a source, or by a macro of these headers."""
    headers = ROOT / "targets/esp32/test/idf_api"
    sources = [path for path in (ROOT / "targets").rglob("*.[ch]") if headers not in path.parents]
    used = set(re.findall(r"\w+", "\n".join(path.read_text() for path in sources)))
    ours = "\n".join(path.read_text() for path in sorted(headers.rglob("*.h")))
    declared = re.findall(r"^(?!static|typedef)\w[\w *]*?(\w+)\([^{]*?\);", ours, re.MULTILINE)
    unused = [name for name in declared if name not in used and len(re.findall(rf"\b{name}\b", ours)) == 1]
    assert len(declared) > 100 and unused == []


def test_ci_machines_without_a_compiler_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "PATH", "/nowhere")
    with pytest.raises(NoToolchainError, match="apt-get install"):
        find_toolchain.__wrapped__()


@pytest.mark.parametrize("chip", CHIPS)
def test_the_radios_start_is_marked(tools: Toolchain, chip: str) -> None:
    """The virtual chip answers this function: its address lies right behind the words by which an image without an ELF
    file has it."""
    (wifi,) = (made for made in objects_of(chip) if made.source.name == "wifi.c")
    words = RADIO_MARK.rstrip(b"\0").decode()
    table = re.search(rf'\.asciz\s+"{words}"\s+\.(?:long|word)\s+(\w+)', wifi.assembly.read_text())
    assert table is not None and table[1] == "esp_wifi_init"
