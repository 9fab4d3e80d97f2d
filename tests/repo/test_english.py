"""The lint of plain English: what users read is checked, what they do not read is not, and our tree passes."""

from __future__ import annotations

from pathlib import Path

import pytest
from lint.english import RULES, check_comments, check_text, has_comments, is_user_visible

ROOT = Path(__file__).resolve().parents[2]

BAD = (
    "The motion stops at once.",
    "After the pause the program goes on.",
    "The board starts anew.",
    "The address is said on the serial ports.",
    "The storage cannot be read: there is none.",
    "This is no request of the protocol.",
    "The machine stands at zero.",
    "It has a password of its own.",
    "The keys beside the settings.",
    "Whoever commands first is the owner.",
    "Grbl has it not.",
    "Run this command to mend the image.",
    "This happens seldom.",
    "A packet that is to be had.",
    "Faster by 3 %, as against Grbl.",
    "It must stay closed so long.",
    "The switches show how their inputs stand.",
    "A port that nobody reads.",
    "What the controller says is shown here.",
    "The host gave motion back.",
    "A client that takes over.",
    "The core runs this job to its end.",
)


@pytest.mark.parametrize("sentence", BAD)
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("core/machine/a.c", 'void f(void) {{\n    text_string(out, "{}");\n}}\n'),
        ("cli/wificnc/a.py", 'def f():\n    raise UserError("{}")\n'),
        ("web/src/view/a.tsx", "const a = (\n  <p>{}</p>\n);\n"),
        ("docs/a.md", "# Title\n{}\n"),
    ],
)
def test_bad_sentence_is_found(name: str, text: str, sentence: str) -> None:
    problems = check_text(Path(name), text.format(sentence))
    assert [problem.line for problem in problems] == [2] * len(problems) != []
    assert all(": write " in problem.message for problem in problems)


def test_every_rule_finds_a_sentence() -> None:
    headings = ("# What holds", "# Who may command")
    unused = [rule.pattern.pattern for rule in RULES if not any(rule.pattern.search(bad) for bad in (*BAD, *headings))]
    assert unused == []


@pytest.mark.parametrize(
    "sentence",
    [
        "The motion stops immediately.",
        "The program continues.",
        "There is no compiler on this computer.",
        "The value is no longer used.",
        "The board has its own network.",
        "S stands for the spindle speed.",
        "The password of its own network.",
    ],
)
def test_plain_sentence_passes(sentence: str) -> None:
    assert check_text(Path("docs/a.md"), sentence) == []


def test_heading_is_a_thing_or_a_task() -> None:
    (problem,) = check_text(Path("docs/a.md"), "## What holds for every sender\n")
    assert "heading" in problem.message
    assert check_text(Path("docs/a.md"), "## Senders\n") == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("core/machine/a.c", "/* It stops at once. */\n"),
        ("web/src/a.ts", "// It stops at once.\nconst a = 1; // at once\n"),
        ("cli/wificnc/a.py", '"""It stops at once."""\n# at once\n'),
        ("docs/a.md", "```\nat once\n```\nthe message `at once`\n"),
    ],
)
def test_comments_and_code_are_not_for_users(name: str, text: str) -> None:
    assert check_text(Path(name), text) == []


def test_help_of_a_command_is_for_users() -> None:
    text = '@click.command()\ndef command() -> None:\n    """Stop at once."""\n'
    assert [problem.line for problem in check_text(Path("cli/wificnc/commands/a.py"), text)] == [3]


def test_which_files_users_read() -> None:
    assert all(
        is_user_visible(Path(name))
        for name in ("README.md", "docs/start/README.md", "core/gcode/status.h", "web/src/app.ts")
    )
    assert not any(
        is_user_visible(Path(name))
        for name in ("tests/cli/test_a.py", "targets/esp32/test/a.c", "core/wire/wire_gen.h")
    )


@pytest.mark.parametrize(
    ("name", "text", "lines"),
    [
        ("core/machine/a.c", 'char *a = "at once"; /* It stops at once. */\n/* Stops at\n * once. */\n', [1, 2]),
        ("web/src/a.ts", "// It stops at once.\nconst a = 'x://at once';\n", [1]),
        ("cli/wificnc/a.py", '"""It stops at once."""\nA = "at once"  # at once\n', [1, 2]),
        ("protocol/a.toml", 'a = "at once"\n# at once\n', [2]),
        ("tests/a.py", 'assert a == "at once", (\n    f"at once: {a}"\n)\npytest.skip("at once")\n', [2, 4]),
    ],
)
def test_phrases_in_comments_are_found(name: str, text: str, lines: list[int]) -> None:
    assert sorted(problem.line for problem in check_comments(Path(name), text)) == lines


@pytest.mark.parametrize(
    "text", ["/* What holds for whoever asks. */", "/* `at once` */", "/* It stops immediately. */"]
)
def test_comments_may_be_terser_than_messages(text: str) -> None:
    assert check_comments(Path("core/machine/a.c"), text + "\n") == []


def test_which_files_have_their_comments_checked() -> None:
    assert all(
        has_comments(Path(name))
        for name in ("core/a.h", "targets/esp32/a.S", "tools/bench/a.py", "boards/a.toml", "tests/cli/test_a.py")
    )
    assert not any(
        has_comments(Path(name)) for name in ("docs/a.md", "tests/boards/invalid/a.toml", "tools/lint/english.py")
    )
