"""tools/suite: what tests take, and which of them a busy computer makes fail."""

from __future__ import annotations

from pathlib import Path

import pytest
from suite import trust
from suite.__main__ import main
from suite.mutants import chosen_mutants, mutants_of
from wificnc.build.checkout import checkout_root

TIMES = """1.5000\t0.5000\tcore\ttests/a/test_a.py::test_x[1]
2.0000\t1.0000\tcore\ttests/a/test_a.py::test_x[b::c]
9.0000\t0.2500\trealtime\ttests/b/test_b.py::test_y
"""


@pytest.mark.parametrize(
    ("by", "names"),
    [
        ("ring", ["core", "realtime"]),
        ("folder", ["core     tests/a", "realtime tests/b"]),
        ("file", ["core     tests/a/test_a.py", "realtime tests/b/test_b.py"]),
        ("test", ["core     tests/a/test_a.py::test_x", "realtime tests/b/test_b.py::test_y"]),
    ],
)
def test_times_are_added_up(by: str, names: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "times").write_text(TIMES)
    assert main(["times", str(tmp_path / "times"), "--by", by]) == 0
    _, *rows = capsys.readouterr().out.splitlines()
    assert rows == [f"    2     3.5     1.5  {names[0]}", f"    1     9.0     0.2  {names[1]}"]


def test_a_run_names_its_failures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = (
        "FAILED tests/a/test_a.py::test_x[a-b] - assert 1 == 2\nERROR emulators/tests/b/test_b.py::test_y\n2 failed\n"
    )
    monkeypatch.setattr(trust, "SAID", tmp_path)

    class Done:
        returncode, stdout, stderr = 1, said, ""

    monkeypatch.setattr("subprocess.run", lambda *_words, **_more: Done)
    assert trust.run(["tests/a"], 3) == ["tests/a/test_a.py::test_x[a-b]", "emulators/tests/b/test_b.py::test_y"]
    assert (tmp_path / "run-3.txt").read_text() == said


def test_what_failed_once_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(trust, "SAID", tmp_path / "said")
    monkeypatch.setattr(trust, "run", lambda tests, number: tests if number == 2 else [])
    assert main(["trust", "tests/a", "--runs", "3", "--load", "0"]) == 1
    assert "1 of 3 times: tests/a\n1 not to be trusted" in capsys.readouterr().out
    assert main(["trust", "tests/a", "--runs", "1", "--load", "0"]) == 0
    assert capsys.readouterr().out.endswith("all can be trusted\n")


def test_a_fault_is_made_of_code_alone(tmp_path: Path) -> None:
    (tmp_path / "a.c").write_text(
        """#include <a.h>
/* a < b */
 * a < b
    if (a < b && say("x < y")) // c < d
        p->q++; /* 1 + 2 */
"""
    )
    made = mutants_of(tmp_path, Path("a.c"))
    assert [(mutant.line, mutant.new.strip()) for mutant in made] == [
        (4, 'if (a <= b && say("x < y")) // c < d'),
        (4, 'if (a < b || say("x < y")) // c < d'),
    ]
    assert str(made[0]) == 'a.c:4: if (a < b && say("x < y")) // c < d  ->  if (a <= b && say("x < y")) // c < d'


def test_the_same_seed_makes_the_same_faults_in_all_places() -> None:
    first = chosen_mutants(checkout_root(), 40, seed=0)
    assert first == chosen_mutants(checkout_root(), 40, seed=0) != chosen_mutants(checkout_root(), 40, seed=1)
    assert {mutant.path.parts[0] for mutant in first} == {"core", "targets", "cli"}
    assert all(mutant.old != mutant.new for mutant in first)
