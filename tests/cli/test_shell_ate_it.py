"""Settings by their numbers, of which an unquoted `$1` loses its first digit: refused, not another one set."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from wificnc.connection.settings import all_known, assignment, find
from wificnc.errors import UserError

Cli = Callable[..., tuple[int, str, str]]
NUMBERS = sorted(entry.number for entry in all_known())

NOWHERE = "tcp://127.0.0.1:1"
COMMANDS = {
    "settings set": ("settings", "set", "{0}", "--to", NOWHERE),
    "sim": ("sim", "{file}", "--set", "{0}"),
    "check": ("check", "{file}", "--machine", "baseline", "--set", "{0}"),
    "tune predict": ("tune", "predict", "{file}", "--hz", "40", "--set", "{0}"),
    "serve": ("serve", "--set", "{0}"),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    job = tmp_path / "job.nc"
    job.write_text("G91G1X1F600\n")
    return job


def run(cli: Cli, command: str, file: Path, text: str) -> tuple[int, str, str]:
    return cli(*(word.format(text, file=file) for word in COMMANDS[command]))


def by_shell(number: int, value: str) -> str:
    """What sh makes of $N=VALUE without quotes: $0 is its own name, $1 to $9 its words, of which it has none."""
    first, *rest = str(number)
    return f"{'sh' if first == '0' else ''}{''.join(rest)}={value}"


@pytest.mark.skipif(shutil.which("sh") is None, reason="sh is not here")
def test_a_shell_does_so() -> None:
    words = [f"${number}=200" for number in NUMBERS]
    said = subprocess.run(["sh", "-c", f"printf '%s\\n' {' '.join(words)}"], capture_output=True, text=True, check=True)
    assert said.stdout.splitlines() == [by_shell(number, "200") for number in NUMBERS]


@pytest.mark.parametrize("number", NUMBERS)
def test_what_a_shell_leaves_of_a_setting_is_no_other_setting(number: int) -> None:
    left = by_shell(number, "200")
    with pytest.raises(UserError) as refused:
        assignment(left)
    assert refused.value.hint and "quote it: '$" in refused.value.hint
    if number > 9:
        names = {entry.number: entry.name for entry in all_known()}
        suffix = str(number)[1:]
        offered = [int(text) for text in re.findall(r"'\$(\d+)'", refused.value.hint)]
        assert offered and all(str(each)[1:] == suffix or each == int(suffix) for each in offered)
        assert all(names[each] in refused.value.hint for each in offered)


@pytest.mark.parametrize("number", NUMBERS)
def test_what_is_quoted_or_named_is_that_setting(number: int) -> None:
    names = {entry.number: entry.name for entry in all_known()}
    assert assignment(f"${number}=200") == assignment(f"{names[number]}=200") == (number, "200")
    assert assignment(f" ${number} = on ") == (number, "1")


@pytest.mark.parametrize("number", [100, 110, 88, 376])
def test_a_bare_number_that_is_the_rest_of_none_is_taken(number: int) -> None:
    assert find(str(number)) == number


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("text", ["30=200", "=200", "2=1", "bash=10"])
def test_each_command_refuses_it(cli: Cli, file: Path, command: str, text: str) -> None:
    code, out, err = run(cli, command, file, text)
    assert code == 2 and out == "" and "quote it: '$" in err


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("text", "why", "hint"),
    [
        ("max_rat_mm_min.x=5000", "unknown setting max_rat_mm_min.x", "did you mean max_rate_mm_min.x?"),
        ("max_rate_mm_min=5000", "has a value for each axis", "max_rate_mm_min.x"),
        ("$110", "is not an assignment", "a setting looks like"),
        ("$110=", "is not an assignment", "a setting looks like"),
    ],
)
def test_other_faults_have_their_own_hint(cli: Cli, file: Path, command: str, text: str, why: str, hint: str) -> None:
    code, _, err = run(cli, command, file, text)
    assert code == 2 and why in err and hint in err and "quote" not in err


@pytest.mark.parametrize("value", ["fast", "1e3", "5000mm", "0x10", "٣"])
def test_a_value_that_is_no_number_is_refused(cli: Cli, file: Path, value: str) -> None:
    code, _, err = run(cli, "sim", file, f"$110={value}")
    assert code == 2 and f"'{value}' is not a number" in err and "quote" not in err


def test_names_and_words_set_what_they_say(cli: Cli, file: Path) -> None:
    named = cli("sim", str(file), "--json", "-", "--set", "max_rate_mm_min.x=60", "--set", "laser_mode=on")
    numbered = cli("sim", str(file), "--json", "-", "--set", "$110=60", "--set", "$32=1")
    assert named == numbered and named[0] == 0 and named != cli("sim", str(file), "--json", "-")


def test_get_refuses_the_rest_of_a_number(cli: Cli) -> None:
    code, _, err = cli("settings", "get", "30", "--to", NOWHERE)
    assert code == 2 and "'$130' (max_travel_mm.x)" in err
