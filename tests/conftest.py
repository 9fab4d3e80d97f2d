"""Tests on all cores (`make test`): a worker takes whole folders, so that what its session builds is built once."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import PurePosixPath

import pytest
from hypothesis import settings
from skips import closing_lines, complaint, is_forbidden
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

# A busy computer is no failure: speed is measured by make bench.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


class FolderScheduling(LoadScopeScheduling):
    """xdist's scheduling by scope, where a scope is a folder."""

    def _split_scope(self, nodeid: str) -> str:
        return str(PurePosixPath(nodeid.split("::", 1)[0]).parent)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> FolderScheduling:
    return FolderScheduling(config, log)


def _reason(report: pytest.TestReport | pytest.CollectReport) -> str:
    return report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Which package brings skipped tests back."""
    for line in closing_lines(_reason(report) for report in terminalreporter.stats.get("skipped", [])):
        terminalreporter.write_line(line)


def _fail_a_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Where CI must have everything (tests/support/skips.py)."""
    if not report.skipped or hasattr(report, "wasxfail"):
        return
    reason = _reason(report)
    if is_forbidden(reason):
        report.outcome = "failed"
        report.longrepr = complaint(reason)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    _fail_a_skip(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    _fail_a_skip(report)
    return report
