"""Every rule has a file that breaks it and nothing else; and broken files are reported in full, with lines."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.board import paths
from wificnc.board.chip import load_chips
from wificnc.board.load import check_board, load_board
from wificnc.board.problem import RULES, BoardProblems
from wificnc.board.rules import ALLOWABLE
from wificnc.errors import BoardError
from wificnc.files.tomlfile import read_toml

INVALID = sorted((Path(__file__).parent / "invalid").glob("*.toml"))
GOOD_TEXT = (paths.BOARDS / "esp32-wroom32.toml").read_text(encoding="utf-8")


def expectation(path: Path) -> tuple[str, str]:
    """The first line: # [rule] what the message says"""
    rule, _, message = path.read_bytes().split(b"\n", 1)[0].decode().removeprefix("# [").partition("] ")
    return rule, message


def edited(tmp_path: Path, old: str, new: str) -> Path:
    assert GOOD_TEXT.count(old) == 1, old
    path = tmp_path / "edited.toml"
    path.write_text(GOOD_TEXT.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize("path", INVALID, ids=lambda path: path.stem)
def test_invalid_file_breaks_its_rule_and_no_other(path: Path) -> None:
    rule, message = expectation(path)
    assert path.stem == rule
    (problem,) = check_board(path)
    assert problem.rule == rule
    assert message in f"{problem.key}: {problem.reason} {problem.hint or ''}"


@pytest.mark.parametrize(
    ("first", "second", "fine"),
    [
        ("limit", "limit", True),
        ("limit_max", "limit_max", True),
        ("limit", "limit_min", True),
        ("limit_min", "limit", True),
        ("limit_max", "limit_min", False),
        ("limit_min", "limit_max", False),
    ],
)
def test_both_motors_of_a_gantry_have_a_limit_at_one_end(tmp_path: Path, first: str, second: str, fine: bool) -> None:
    """Otherwise one of them seeks a switch that is at the other end, and racks the gantry until ALARM:10."""
    text = (paths.BOARDS / "esp32-wroom32-gantry.toml").read_text(encoding="utf-8")
    for pin, name in (("GPIO39", first), ("GPIO35", second)):
        old = f'limit = {{ pin = "{pin}"'
        assert text.count(old) == 1
        text = text.replace(old, f'{name} = {{ pin = "{pin}"')
    path = tmp_path / "gantry.toml"
    path.write_text(text, encoding="utf-8")
    assert [(each.rule, each.key) for each in check_board(path)] == [("second-switch", "axis.y.second")] * (not fine)


def test_every_rule_has_an_invalid_file() -> None:
    assert {path.stem for path in INVALID} == set(RULES)


def test_what_can_be_allowed_is_a_rule() -> None:
    assert set(ALLOWABLE) <= set(RULES)


@pytest.mark.parametrize("path", [path for path in INVALID if path.stem in ALLOWABLE], ids=lambda path: path.stem)
def test_a_risk_with_a_reason_passes(path: Path, tmp_path: Path) -> None:
    (problem,) = check_board(path)
    lines = path.read_text(encoding="utf-8").split("\n")
    line = lines[problem.line - 1]
    key, _, value = line.partition(" = ")
    table = value.removeprefix("{ ").removesuffix(" }") if value.startswith("{") else f"pin = {value}"
    lines[problem.line - 1] = f'{key} = {{ {table}, allow = {{ {problem.rule} = "the wiring takes care" }} }}'
    allowed = tmp_path / "allowed.toml"
    allowed.write_text("\n".join(lines), encoding="utf-8")
    assert check_board(allowed) == []


def test_an_allow_needs_a_reason(tmp_path: Path) -> None:
    path = edited(tmp_path, '"sets only the timing of the SDIO slave, which is never started"', '"ok"')
    (problem,) = check_board(path)
    assert (problem.rule, problem.key) == ("bad-value", "input.estop.allow.strapping")


def test_all_problems_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = GOOD_TEXT.replace('step = "GPIO25"', 'step = "GPIO6"').replace('dir = "GPIO32"', 'dir = "GPIO33"')
    text = text.replace('spindle_enable = "GPIO17"', 'spindle_enable = "GPIO5"')
    path = tmp_path / "many.toml"
    path.write_text(text, encoding="utf-8")
    problems = check_board(path)
    found = [(problem.rule, problem.key) for problem in problems]
    assert ("taken", "axis.x.step") in found
    assert ("used-twice", "axis.y.dir") in found
    assert ("boot-level", "output.spindle_enable") in found
    assert ("stale-deviation", "deviation[0]") in found
    lines = text.split("\n")
    assert [problem.line for problem in problems] == sorted(problem.line for problem in problems)
    for problem in problems:
        if problem.rule == "taken":
            assert lines[problem.line - 1] == 'step = "GPIO6"'


def test_the_published_wroom_spindle_is_refused_for_what_it_would_do(tmp_path: Path) -> None:
    path = edited(tmp_path, 'spindle_enable = "GPIO17"', 'spindle_enable = "GPIO5"')
    reasons = [problem.reason for problem in check_board(path) if problem.rule == "boot-level"]
    assert reasons == ["GPIO5 has a pull-up from reset until the firmware runs, and high switches spindle_enable on"]


def test_hint_names_only_pins_that_pass(tmp_path: Path) -> None:
    path = edited(tmp_path, 'spindle_enable = "GPIO17"', 'spindle_enable = "GPIO25"')
    hints = {problem.hint for problem in check_board(path) if problem.rule == "used-twice"}
    assert hints == {"free and legal for spindle_enable: GPIO17"}
    assert check_board(edited(tmp_path, 'spindle_enable = "GPIO17"', 'spindle_enable = "GPIO17" # same')) == []


def test_misspelt_key_and_its_missing_twin_are_one_problem(tmp_path: Path) -> None:
    path = edited(tmp_path, "max_step_rate_hz = 250_000", "max_step_rate = 250_000")
    (problem,) = check_board(path)
    assert (problem.rule, problem.hint) == ("unknown-key", "did you mean max_step_rate_hz?")


@pytest.mark.parametrize(
    ("old", "new", "rule", "key"),
    [
        ("schema = 1", 'schema = "1"', "bad-value", "schema"),
        ("schema = 1", "schema = 2", "bad-value", "schema"),
        ("timer_hz = 20_000_000", "timer_hz = true", "bad-value", "timing.timer_hz"),
        ("timer_hz = 20_000_000", "timer_hz = 2e7", "bad-value", "timing.timer_hz"),
        ("timer_hz = 20_000_000", "timer_hz = 0", "bad-value", "timing.timer_hz"),
        ('step = "GPIO25"', "step = 25", "bad-value", "axis.x.step"),
        ('probe = { pin = "GPIO15",', 'probe = { pul = "up", pin = "GPIO15",', "unknown-key", "input.probe.pul"),
        ('probe = { pin = "GPIO15",', 'probe = { pull = "high", pin = "GPIO15",', "bad-value", "input.probe.pull"),
        ('kind = "plain"', 'kind = "plain"\ndefine = "X"', "unknown-key", "led.define"),
    ],
)
def test_wrong_shapes(tmp_path: Path, old: str, new: str, rule: str, key: str) -> None:
    path = tmp_path / "shape.toml"
    path.write_text(GOOD_TEXT.replace(old, new, 1), encoding="utf-8")
    (problem,) = check_board(path)
    assert (problem.rule, problem.key) == (rule, key)


S3_TEXT = (paths.BOARDS / "esp32s3-devkitc-quad.toml").read_text(encoding="utf-8")


def with_memory(tmp_path: Path, text: str, mode: str, flash_mb: str, psram_mb: str) -> list[tuple[str, str]]:
    _, _, rest = text.partition("[memory]")
    before, (_, _, after) = text.partition("[memory]")[0], rest.partition("\n\n")
    path = tmp_path / "memory.toml"
    memory = f'[memory]\nmode = "{mode}"\nflash_mb = {flash_mb}\npsram_mb = {psram_mb}\n\n'
    path.write_text(before + memory + after, encoding="utf-8")
    return [(problem.rule, problem.key) for problem in check_board(path) if problem.rule == "memory-mode"]


@pytest.mark.parametrize(
    ("text", "mode", "flash_mb", "psram_mb", "keys"),
    [
        (S3_TEXT, "quad", "[8]", "[8]", ["memory.psram_mb[0]"]),  # octal: pins 33 to 37 are its
        (S3_TEXT, "quad", "[8, 3]", "[0, 2]", ["memory.flash_mb[1]"]),
        (S3_TEXT, "flash", "[8]", "[2]", ["memory.psram_mb[0]"]),
        (S3_TEXT, "octal", "[8]", "[0, 2]", ["memory.psram_mb[0]", "memory.psram_mb[1]"]),
        (S3_TEXT, "quad", "[0]", "[-1]", ["memory.flash_mb[0]", "memory.psram_mb[0]"]),
        (S3_TEXT, "quad", "[4, 8, 16]", "[0, 2]", []),
        (GOOD_TEXT, "flash", "[4]", "[4]", ["memory.psram_mb[0]"]),  # pins 16 and 17 are its
        (GOOD_TEXT, "flash", "[1000]", "[0]", ["memory.flash_mb[0]"]),
        (GOOD_TEXT, "flash", "[4, 8, 16]", "[0]", []),
    ],
)
def test_memory_that_the_variant_does_not_come_with(
    tmp_path: Path, text: str, mode: str, flash_mb: str, psram_mb: str, keys: list[str]
) -> None:
    """Its pins would pass as free ones."""
    assert with_memory(tmp_path, text, mode, flash_mb, psram_mb) == [("memory-mode", key) for key in keys]


def test_every_memory_variant_has_its_sizes() -> None:
    for chip in load_chips().values():
        assert chip.memory.keys() == chip.memory_sizes.keys()


SHAPES = {  # a fault in the shape, and the rules that it alone breaks
    'step = "GPIO25"': ("step = 25", "axis.x.step"),
    "schema = 1": ("schema = 2", "schema"),
    'kind = "plain"': ('kind = "plain"\ndefine = "X"', "led.define"),
    "timer_hz = 20_000_000": ("timer_hz = 0", "timing.timer_hz"),
    'mode = "flash"': ("mode = 3", "memory.mode"),
    'dir = "GPIO32"': ('dri = "GPIO32"', "axis.y.dri"),
}


@pytest.mark.parametrize("old", SHAPES)
def test_faults_of_shape_and_of_rules_in_one_run(tmp_path: Path, old: str) -> None:
    """Each is there alone, and so they are together; a fault of shape brings no other one with it."""
    new, key = SHAPES[old]
    assert GOOD_TEXT.count(old) >= 1
    alone = GOOD_TEXT.replace(old, new, 1)
    path = tmp_path / "shape.toml"
    path.write_text(alone, encoding="utf-8")
    assert [problem.key for problem in check_board(path)] == [key]
    path.write_text(alone.replace('spindle_enable = "GPIO17"', 'spindle_enable = "GPIO34"'), encoding="utf-8")
    found = check_board(path)
    assert {problem.key for problem in found} == {key, "output.spindle_enable"}
    assert "input-only" in {problem.rule for problem in found}
    assert [problem.line for problem in found] == sorted(problem.line for problem in found)


def test_an_unknown_chip_and_a_fault_of_shape_in_one_run(tmp_path: Path) -> None:
    path = tmp_path / "chip.toml"
    path.write_text(
        GOOD_TEXT.replace('chip = "esp32"', 'chip = "esp99"').replace("timer_hz", "timer_h"), encoding="utf-8"
    )
    assert {problem.rule for problem in check_board(path)} == {"unknown-chip", "unknown-key"}


def test_no_such_board_suggests_one() -> None:
    with pytest.raises(BoardError) as caught:
        load_board("esp32s3-zerro")
    assert caught.value.hint == "did you mean esp32s3-zero?"


def test_missing_file_and_directory_are_told(tmp_path: Path) -> None:
    for path in (tmp_path / "nothing.toml", tmp_path):
        with pytest.raises(BoardProblems) as caught:
            load_board(path)
        assert [problem.rule for problem in caught.value.problems] == ["unreadable"]


def test_windows_line_ends_change_nothing(tmp_path: Path) -> None:
    path = tmp_path / "esp32-wroom32.toml"
    path.write_bytes(GOOD_TEXT.replace("\n", "\r\n").encode())
    assert load_board(path).sha256 == load_board("esp32-wroom32").sha256


@given(st.data())
def test_a_damaged_file_never_crashes_the_checker(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    lines = GOOD_TEXT.split("\n")
    index = data.draw(st.integers(0, len(lines) - 1))
    damage = data.draw(st.sampled_from(["drop", "double", "cut", "swap"]))
    if damage == "drop":
        del lines[index]
    elif damage == "double":
        lines.insert(index, lines[index])
    elif damage == "cut":
        lines[index] = lines[index][: data.draw(st.integers(0, len(lines[index])))]
    else:
        other = data.draw(st.integers(0, len(lines) - 1))
        lines[index], lines[other] = lines[other], lines[index]
    path = tmp_path_factory.getbasetemp() / "damaged.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    for problem in check_board(path):
        assert 1 <= problem.line <= len(lines)


LOCATED = """\
# comment with [brackets] and = signs
schema = 1
"quoted key" = "a # no comment, } ] no brackets"
a.b = 'dotted'
[table] # head
text = \"\"\"
two
lines \\"\"\"\"
list = [ # comment ]
  "one", # ,
  { pin = "x", allow = { rule = "]" } },
  [1, 2],
]
after = 1979-05-27 07:32:00
[[many]]
x = 1
[many.sub]
y = 2
[[many]]
x = 3
"""


def test_lines_of_keys(tmp_path: Path) -> None:
    path = tmp_path / "located.toml"
    path.write_text(LOCATED, encoding="utf-8")
    source = read_toml(path)
    expected = {
        ("schema",): "schema",
        ("quoted key",): '"quoted key"',
        ("a", "b"): "a.b",
        ("table",): "[table]",
        ("table", "text"): "text =",
        ("table", "list"): "list =",
        ("table", "list", 0): '  "one"',
        ("table", "list", 1): "  { pin",
        ("table", "list", 1, "allow", "rule"): "  { pin",
        ("table", "list", 2): "  [1, 2]",
        ("table", "list", 2, 1): "  [1, 2]",
        ("table", "after"): "after",
        ("many", 0, "x"): "x = 1",
        ("many", 0, "sub", "y"): "y = 2",
        ("many", 1, "x"): "x = 3",
    }
    lines = LOCATED.split("\n")
    for key, start in expected.items():
        assert lines[source.line(key) - 1].startswith(start), key
    assert source.line(("many", 1, "missing")) == source.line(("many", 1))
