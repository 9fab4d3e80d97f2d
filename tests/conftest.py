"""Tests on all cores (`make test`): a worker takes whole folders, so that what its session builds is built once."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import PurePosixPath

import pytest
from skips import complaint, is_forbidden
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling


class FolderScheduling(LoadScopeScheduling):
    """xdist's scheduling by scope, where a scope is a folder."""

    def _split_scope(self, nodeid: str) -> str:
        return str(PurePosixPath(nodeid.split("::", 1)[0]).parent)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> FolderScheduling:
    return FolderScheduling(config, log)


def _fail_a_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Where CI must have everything (tests/support/skips.py)."""
    if not report.skipped or hasattr(report, "wasxfail"):
        return
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
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
