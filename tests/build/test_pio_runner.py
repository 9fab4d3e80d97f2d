"""PlatformIO's runner of the C tests (tests/native/test_custom_runner.py): a failure is one, and so is a crash."""

from __future__ import annotations

import importlib.util
from types import ModuleType, SimpleNamespace

import pytest
from wificnc.build.checkout import checkout_root

pytest.importorskip("platformio")
from platformio.test import result


@pytest.fixture(scope="module")
def runner() -> ModuleType:
    """PlatformIO wants a name that pytest would take for a test's."""
    path = checkout_root() / "tests" / "native" / "test_custom_runner.py"
    spec = importlib.util.spec_from_file_location("pio_runner", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def suite_after(runner: ModuleType, lines: list[str]) -> result.TestSuite:
    """What PlatformIO has seen when the program has said these lines."""
    suite = result.TestSuite("native", "test_core")
    suite.on_start()
    itself = SimpleNamespace(said=[], test_suite=suite)
    for line in lines:
        runner.CustomTestRunner.on_testing_line_output(itself, line)
    return suite


@pytest.mark.parametrize(
    ("lines", "failed"),
    [
        (["0 failures\n"], False),
        (["a sign alone is a number\n", "1 failures\n"], True),
    ],
)
def test_the_last_line_decides(runner: ModuleType, lines: list[str], failed: bool) -> None:
    suite = suite_after(runner, lines)
    assert [case.status == result.TestStatus.FAILED for case in suite.cases] == [failed] and suite.is_finished()
    assert not failed or "a sign alone is a number" in str(suite.cases[0].message)


def test_a_program_that_says_no_count_has_no_result(runner: ModuleType) -> None:
    """PlatformIO then reports the test as failed, by the program's exit."""
    suite = suite_after(runner, ["half a line\n"])
    assert not suite.cases and not suite.is_finished()
