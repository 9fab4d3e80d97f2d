"""Tests on all cores (`make test`): a worker takes whole files (tests/support/file_scheduling.py)."""

from __future__ import annotations

import gc
import os
from collections.abc import Generator
from contextlib import ExitStack
from pathlib import Path

import core_only
import pytest
from file_scheduling import FileScheduling
from hypothesis import HealthCheck, settings
from made_key import use_made_key
from rings import Ring, mark_rings
from sample import CasesOfCi, Slice, part_of, sampled
from skips import closing_lines, complaint, is_forbidden
from times import timed
from xdist.remote import Producer

# A busy computer is no failure: speed is measured by make bench. And no run has other examples than the one before;
# for others: --hypothesis-profile=seeded --hypothesis-seed=N.
UNTIMED = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow], "database": None}
settings.register_profile("same", derandomize=True, **UNTIMED)
settings.register_profile("seeded", **UNTIMED)
settings.load_profile("same")

core_only.install()

# Arrays here are small: threads of numpy's BLAS, which programs that tests start would have, too, only cost time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

use_made_key()

# Folders that take longest, the longest first: a long one that starts last leaves the other workers idle. First those
# that one worker takes whole (tests/support/file_scheduling.py), then those that wait, while others compute.
LONGEST_FIRST = (
    *("pic32mz", "xtensa", "esp32", "release", "build", "linuxcnc", "web", "senders", "serve", "wire", "link"),
    *("grbl", "motion", "states", "repo", "gcode", "cli"),
)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """Twice as many as processors, because tests also wait, for browsers and real time; those of core do not."""
    if os.environ.get("PYTEST_XDIST_AUTO_NUM_WORKERS"):
        return None
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    never_wait = config.option.markexpr.startswith(Ring.CORE.value) or config.getoption("--slice")
    return cores if never_wait else 2 * cores


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Nothing of ten thousand tests is garbage: it is not searched for any, now or later."""
    gc.disable()
    result = yield
    gc.freeze()
    gc.enable()
    return result


def _rank(item: pytest.Item) -> int:
    folder = item.nodeid.split("/")[1:2]
    return LONGEST_FIRST.index(folder[0]) if folder and folder[0] in LONGEST_FIRST else len(LONGEST_FIRST)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cases", type=int, default=0, metavar="N", help="of each test at most N cases; 0: all")
    said = "part K of N of what CI leaves out: deep cases, and those of hypothesis (with another seed)"
    parser.addoption("--slice", type=part_of, metavar="K/N", help=said)
    said = "append what each test takes: seconds, seconds of the processor, ring, test"
    parser.addoption("--times", type=Path, metavar="FILE", help=said)
    said = "of tests whose cases are alike some stay for CI, and the others are marked deep"
    parser.addoption("--cases-of-ci", action="store_true", help=said)


class Rings:
    """Each test has its ring, and the tests of core keep to it. A plugin: its hook comes behind those of folders, which
    choose cases, and before -m, which looks at the markers."""

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        mark_rings(items)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        ring = next((ring for ring in Ring if item.get_closest_marker(ring.value)), None)
        with ExitStack() as stack:
            if file := item.config.getoption("--times"):
                stack.enter_context(timed(file, ring.value if ring else "", item.nodeid))
            if ring is Ring.CORE:
                stack.enter_context(core_only.core_only(item.nodeid))
            return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_teardown(self, nextitem: pytest.Item | None) -> Generator[None, object, object]:
        if nextitem is None:  # what the whole session shares ends now, and may be of another ring
            core_only.allow_again()
        return (yield)


@pytest.hookimpl(trylast=True)  # of those that -m and -k leave
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    items.sort(key=_rank)  # stable: the order within a folder stays
    if most := config.getoption("--cases"):
        kept = sampled([item.nodeid for item in items], most)
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in kept])
        items[:] = [item for item in items if item.nodeid in kept]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> FileScheduling:
    return FileScheduling(config, log)


def _reason(report: pytest.TestReport | pytest.CollectReport) -> str:
    return report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)


class Failures:
    """Names each failed test when it fails: a run that is cut off has no summary."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        terminal = self.config.pluginmanager.get_plugin("terminalreporter")
        if report.failed and terminal is not None:
            crash = getattr(report.longrepr, "reprcrash", None)
            message = crash.message if crash else report.longreprtext
            terminal.write_line("")
            terminal.write_line(f"{report.nodeid}: {message.strip().partition(chr(10))[0][:200]}")
            if part := self.config.getoption("--slice"):
                terminal.write_line(
                    f"again, with the others of that part: python tools/dev.py test-slice --part {part[0]}"
                )


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--cases-of-ci"):
        config.pluginmanager.register(CasesOfCi())
    if part := config.getoption("--slice"):
        config.pluginmanager.register(Slice(*part))
    config.pluginmanager.register(Rings())  # last, so its hook comes first
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Failures(config))


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
