"""tools/dev.py, which `make` calls: the same commands on every system."""

from __future__ import annotations

import ast
import os
import sys
from pathlib import Path

import dev
import pytest
from wificnc.build.checkout import checkout_root

ROOT = checkout_root()


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """What it would run, in an environment that is ready."""
    commands: list[list[str]] = []
    monkeypatch.setattr(dev, "set_up", lambda venv, dev: commands.append([f"set up {venv.name}{' dev' * dev}"]))
    monkeypatch.setattr(dev, "run", lambda command, folder=ROOT: commands.append([*map(str, command[1:])]) or 0)
    monkeypatch.setattr(dev, "compile_tests", lambda python: commands.extend([["compile tests"]]))
    return commands


def test_each_command_has_its_tests(ran: list[list[str]]) -> None:
    words = ["tests/gcode", "-x", "-k", "arc and not slow"]
    chosen = {"test": "not slow and not deep", "test-all": "not deep", "test-deep": "deep"}
    for command, marked in chosen.items():
        ran.clear()
        assert dev.main([command, *words]) == 0
        pytest_words = ["-m", "pytest", "-n", "auto", "--no-loadscope-reorder", "-m", marked, *words]
        assert ran == [["set up .venv dev"], ["-m", "wificnc", "build", "host"], pytest_words]


def test_all_tests_are_compiled_before_they_run(ran: list[list[str]]) -> None:
    assert dev.main(["test"]) == 0
    assert [words[:2] for words in ran[-2:]] == [["compile tests"], ["-m", "pytest"]]


def test_what_ci_leaves_out_is_what_each_night_runs(ran: list[list[str]]) -> None:
    """`make test` is a sample of its own."""
    samples = {}
    for command in dev.CHOSEN:
        assert dev.main([command]) == 0
        samples[command] = [word for word in ran[-1] if word.startswith("--cases")]
    assert samples["test"] == ["--cases=3"]
    assert samples["test-all"] == samples["test-deep"] == ["--cases-of-ci"]


def test_each_test_file_is_compiled_once_and_not_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    (tmp_path / "pytest.ini").touch()
    for folder in "abc":
        (tmp_path / "tests" / folder).mkdir(parents=True)
        (tmp_path / "tests" / folder / f"test_{folder}.py").write_text("def test_it():\n    assert 1 + 1 == 2\n")
    dev.compile_tests(Path(sys.executable))
    assert len(list(tmp_path.glob("tests/*/__pycache__/test_*-pytest-*.pyc"))) == 3
    monkeypatch.setattr("subprocess.Popen", lambda *_words, **_more: pytest.fail("compiled again"))
    dev.compile_tests(Path(sys.executable))


def test_demo_needs_no_tools_of_developers(ran: list[list[str]]) -> None:
    assert dev.main(["--venv", "other", "demo", "-o", "a.png"]) == 0
    assert ran == [["set up other"], ["-m", "wificnc", "demo", "-o", "a.png"]]


def test_lint_takes_names(ran: list[list[str]]) -> None:
    assert dev.main(["lint", "ruff", "house"]) == 0
    assert ran[1:] == [["-m", "lint", "ruff", "house"]]


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
    (tmp_path / "pyproject.toml").touch()
    venv = tmp_path / ".venv"
    dev.set_up(venv, dev=True)
    dev.set_up(venv, dev=False)
    dev.set_up(venv, dev=True)
    assert installed == ["plot,esp,dev"]
    newer = (venv / ".ready").stat().st_mtime + 10
    os.utime(tmp_path / "pyproject.toml", (newer, newer))
    dev.set_up(venv, dev=False)
    assert installed == ["plot,esp,dev", "plot"]


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
