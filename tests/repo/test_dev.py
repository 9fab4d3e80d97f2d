"""tools/dev.py, which `make` calls: the same commands on every system."""

from __future__ import annotations

import ast
import os
import sys
from pathlib import Path

import dev
import pytest
from tools_here import needs_git
from wificnc.build.checkout import checkout_root

ROOT = checkout_root()


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """What it would run, in an environment that is ready."""
    commands: list[list[str]] = []
    monkeypatch.setattr(dev, "set_up", lambda venv, dev: commands.append([f"set up {venv.name}{' dev' * dev}"]))

    def run(command: list[str | Path], folder: Path = ROOT, also: dict[str, str] | None = None) -> int:
        commands.append([*[f"{name}={value}" for name, value in (also or {}).items()], *map(str, command[1:])])
        return 0

    monkeypatch.setattr(dev, "run", run)
    monkeypatch.setattr(dev, "compile_tests", lambda python: commands.extend([["compile tests"]]))
    return commands


PYTEST = ["-m", "pytest", "-n", "auto", "--no-loadscope-reorder"]


@pytest.mark.parametrize(
    ("words", "chosen"),
    [
        (["test"], ["-m", "core and not deep", "--cases-of-ci"]),
        (["test", "-x"], ["-m", "core and not deep", "--cases-of-ci", "-x"]),
        (["test", "--ring", "chips"], ["-m", "chips and not deep", "--cases-of-ci"]),
        (["test", "--ring", "realtime", "-k", "arc"], ["-m", "realtime and not deep", "--cases-of-ci", "-k", "arc"]),
        (["test", "tests/web", "-x"], ["-m", "not deep", "tests/web", "-x"]),
        (["test", "--ring", "core", "tests/grbl"], ["-m", "core and not deep", "tests/grbl"]),
        (["test-all"], ["-m", "not deep", "--cases-of-ci"]),
        (["test-deep"], ["-m", "deep", "--cases-of-ci"]),
        (["test-deep", "tests/repo/test_dev.py::test_x"], ["-m", "deep", "tests/repo/test_dev.py::test_x"]),
    ],
)
def test_each_command_has_its_tests(ran: list[list[str]], words: list[str], chosen: list[str]) -> None:
    """Tests that are named run with all their cases, whatever their ring."""
    assert dev.main(words) == 0
    assert [row for row in ran if row != ["compile tests"]] == [
        ["set up .venv dev"],
        ["-m", "generate.built"],
        ["-m", "wificnc", "build", "host"],
        [*PYTEST, *chosen],
    ]


def test_a_slice_is_the_commits_and_can_be_asked_for_again(
    ran: list[list[str]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(dev, "slice_of_commit", lambda: 7)
    for words in (["test-slice"], ["test-slice", "--part", "7"]):
        assert dev.main(words) == 0
        seeded = ["--hypothesis-profile=seeded", "--hypothesis-seed=7"]
        sliced = [f"--slice=7/{dev.SLICES}", *seeded, "--cases-of-ci"]
        assert ran[-1] == ["WIFICNC_ON_CHIP=all", *PYTEST, *sliced]
        assert "python tools/dev.py test-slice --part 7\n" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        dev.main(["test-slice", "--part", str(dev.SLICES)])


@needs_git
def test_the_slice_of_a_commit_is_one_of_them(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert 0 <= dev.slice_of_commit() < dev.SLICES
    monkeypatch.setattr(dev, "ROOT", tmp_path)  # no repository
    monkeypatch.setenv("GIT_DIR", str(tmp_path))
    assert dev.slice_of_commit() == 0


def test_all_tests_are_compiled_before_they_run(ran: list[list[str]]) -> None:
    assert dev.main(["test"]) == 0
    assert [words[:2] for words in ran[-2:]] == [["compile tests"], ["-m", "pytest"]]


def test_each_test_file_is_compiled_once_and_not_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # as images of containers have it
    (tmp_path / "pytest.ini").touch()
    for folder in ("tests/a", "tests/b", "emulators/tests/c"):
        test = tmp_path / folder / f"test_{folder[-1]}.py"
        test.parent.mkdir(parents=True)
        test.write_text("def test_it():\n    assert 1 + 1 == 2\n")
    dev.compile_tests(Path(sys.executable))
    assert len(list(tmp_path.rglob("__pycache__/test_*-pytest-*.pyc"))) == 3
    monkeypatch.setattr("subprocess.Popen", lambda *_words, **_more: pytest.fail("compiled again"))
    dev.compile_tests(Path(sys.executable))


def test_demo_needs_no_tools_of_developers(ran: list[list[str]]) -> None:
    assert dev.main(["--venv", "other", "demo", "-o", "a.png"]) == 0
    assert ran == [["set up other"], ["-m", "wificnc", "demo", "-o", "a.png"]]


def test_lint_takes_names(ran: list[list[str]]) -> None:
    assert dev.main(["lint", "ruff", "house"]) == 0
    assert ran[1:] == [["-m", "generate.built"], ["-m", "lint", "ruff", "house"]]


def test_a_wrong_table_ends_it(ran: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dev, "run", lambda command, folder=ROOT: ran.append([*map(str, command)]) or 1)
    for words in (["test"], ["lint"], ["setup"]):
        assert dev.main(words) == 1
        assert ran.pop()[1:] == ["-m", "generate.built"] and ran.pop()[0].startswith("set up")


def test_a_wrong_word_is_refused(ran: list[list[str]], capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["tset"], ["setup", "--fast"], []):
        with pytest.raises(SystemExit) as caught:
            dev.main(words)
        assert caught.value.code == 2
    assert ran == [] and "setup takes --dev or nothing, not --fast" in capsys.readouterr().err


def test_what_is_ready_is_not_installed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[str] = []
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    monkeypatch.setattr(dev, "create", lambda venv: venv.mkdir(exist_ok=True))
    monkeypatch.setattr(dev, "install", lambda venv, extras: installed.append(extras))
    monkeypatch.setenv("CC", "cc")
    (tmp_path / "emulators").mkdir()
    for package in dev.PACKAGES:
        (tmp_path / package).touch()
    venv = tmp_path / ".venv"
    dev.set_up(venv, dev=True)
    dev.set_up(venv, dev=False)
    dev.set_up(venv, dev=True)
    assert installed == ["plot,esp,dev"]
    for package in dev.PACKAGES:
        installed.clear()
        newer = (venv / ".ready").stat().st_mtime + 10
        os.utime(tmp_path / package, (newer, newer))
        dev.set_up(venv, dev=False)
        assert installed == ["plot"]
        os.utime(tmp_path / package, (0, 0))


def test_a_compiler_comes_from_pypi_where_there_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[str] = []
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    monkeypatch.setattr(dev, "create", lambda venv: venv.mkdir())
    monkeypatch.setattr(dev, "install", lambda venv, extras: installed.append(extras))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    (tmp_path / "pyproject.toml").touch()
    dev.set_up(tmp_path / ".venv", dev=False)
    assert installed == ["plot", "toolchain"]


def test_it_needs_nothing_but_python() -> None:
    tree = ast.parse((ROOT / "tools" / "dev.py").read_text(encoding="utf-8"))
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} <= sys.stdlib_module_names


def test_the_readme_names_its_commands() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "python tools/dev.py demo" in readme and "python tools/dev.py test " in readme
