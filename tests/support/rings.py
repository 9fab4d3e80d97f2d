"""The ring of each test, by what it touches: decided here alone, by folder, with exceptions by file.

- core: virtual time on the host library, the command line in the test's own process, generators, boards. It cannot
  fail because a computer is busy: what waits for a clock is refused while it runs (tests/support/core_only.py).
- chips: virtual chips, objects for their processors, wheels, releases, other platforms. Processes, but no clock.
- realtime: browsers, sockets, pseudo-terminals, LinuxCNC, senders, served controllers.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests"
PLACES = (TESTS, ROOT / "emulators" / "tests")  # no folder of one has a name of the other's


class Ring(Enum):
    """Also the name of the marker."""

    CORE = "core"
    CHIPS = "chips"
    REALTIME = "realtime"


FOLDERS = {
    Ring.CORE: (
        *("boards", "check", "cli", "dial", "drivers", "fluidnc", "fuzz", "gcode", "grbl", "kinematics", "link"),
        *("machine", "motion", "oracle", "repo", "settings", "sim", "spindle", "states", "tune", "wire"),
    ),
    Ring.CHIPS: (
        *("budget", "build", "esp32", "mips", "native", "pic32mz", "release", "xtensa"),
        *("espsim", "interface", "mzsim"),  # of emulators/tests
    ),
    Ring.REALTIME: ("linuxcnc", "senders", "serve", "web"),
}

# Files in a folder of another ring, and tests (FILE::TEST) in such a file: most of a file is of the other ring.
EXCEPTIONS = {
    Ring.CORE: (
        *("build/test_bench.py", "build/test_compiler.py", "build/test_sizes.py"),
        "budget/test_motion_bench.py",
        *(f"linuxcnc/test_linuxcnc_{name}.py" for name in ("failures", "hold", "laser", "link", "reference", "slices")),
        *(f"linuxcnc/test_linuxcnc_{name}.py" for name in ("spindle", "states", "module", "source", "config")),
    ),
    Ring.CHIPS: (  # processes: the command as it is installed, tools of developers, images
        *("cli/test_completion.py", "cli/test_locale.py", "cli/test_start.py", "cli/test_windows.py"),
        "cli/test_json.py::test_a_refusal_leaves_stdout_empty",
        *(
            f"cli/test_no_traceback.py::test_{name}"
            for name in ("a_full_disk", "a_full_disk_of_messages_keeps_the_exit_code")
        ),
        *(
            f"cli/test_no_traceback.py::test_a_{name}"
            for name in ("name_that_is_not_utf8", "reader_that_has_gone_is_no_error")
        ),
        "cli/test_outputs.py::test_what_goes_to_stdout_is_what_goes_to_a_file",
        "boards/test_boards_header.py::test_header_is_the_same_in_every_process",
        *("repo/test_recipes.py", "repo/test_sample.py", "repo/test_site.py", "repo/test_skips.py"),
        *("repo/test_tools.py", "repo/test_workflows.py"),
        "fuzz/test_fuzz.py::test_without_clang_it_says_what_to_install",
        "linuxcnc/test_linuxcnc_source.py::test_sudo_only_when_it_is_wanted",
        "link/test_doctor.py::test_addresses_become_places_in_the_sources",
        "motion/test_motion_pictures.py",
        "repo/test_dev.py::test_each_test_file_is_compiled_once_and_not_again",
        "repo/test_patience.py::test_a_program_under_test_gets_its_signals_whatever_we_inherit",
        "sim/test_sim_cli.py::test_help_needs_neither_numpy_nor_matplotlib",
        "settings/test_power_cut_pc.py::test_old_or_new",
        "settings/test_settings_generate.py::test_what_is_committed_is_fresh",
        "settings/test_store_migration.py::test_pages_of_a_virtual_chip_of_before",
        "settings/test_store_migration.py::test_pic32mz_pages_of_layout_1",
        "states/test_states_on_chip.py",
        "wire/test_access.py::test_a_siphash_is_that_of_another_implementation",
    ),
    Ring.REALTIME: (
        "linuxcnc/test_linuxcnc_config.py::test_a_configuration_is_paired_once_the_controller_has_accepted_the_key",
        *("drivers/test_drivers_cli.py", "spindle/test_drive_served.py", "tune/test_tune_send.py"),
        *(f"link/test_{name}.py" for name in ("commands", "discover", "keyboard", "serve_link", "transport")),
        "link/test_doctor.py::test_the_command_prints_json_for_scripts",
        "link/test_doctor.py::test_every_finding_that_is_not_good_says_how_to_mend_it",
        "link/test_resume.py::test_final_position_on_the_real_core",
        "link/test_resume_hint.py::test_a_drilling_job_that_was_stopped",
        "link/test_resume_hint.py::test_a_refused_line_is_not_called_acknowledged",
        "link/test_stream_core.py",
        *(f"link/test_target.py::test_a_{name}_without_a_scheme" for name in ("command", "device")),
        "link/test_target.py::test_settings_diff_without_a_scheme",
        *(f"esp32/test_{name}.py" for name in ("first_contact", "ota", "page", "shut_out", "telnet", "update_page")),
        *(f"wire/test_{name}.py" for name in ("foreign_client", "lossy", "serve_access", "serve_wire", "wmc3_cli")),
        "cli/test_json.py::test_stdout_is_one_document",
        "cli/test_outputs.py::test_a_file_system_that_refuses",
        "cli/test_keys.py::test_the_key_of_the_environment_logs_in",
    ),
}

# A test of core that takes one of these, itself or by another fixture, is of that ring.
FIXTURES = {
    Ring.CORE: (),
    Ring.CHIPS: ("build", "image"),
    Ring.REALTIME: ("as_user", "bridge", "browser", "hal_program", "serve", "server"),
}

# A case that runs in a virtual chip, wherever its test is: of a parameter with this value.
ON_CHIP = "chip"


class NoRingError(pytest.UsageError):
    """A test file of which this table says nothing."""


def files_of_tests(pattern: str = "test_*.py") -> list[Path]:
    """All files of tests, or those of this pattern."""
    return sorted(path for tests in PLACES for path in tests.rglob(pattern))


def name_of(path: Path) -> str:
    """Of a file of tests, as this table has it: FOLDER/FILE. Raises NoRingError."""
    for tests in PLACES:
        if path.is_relative_to(tests):
            return path.relative_to(tests).as_posix()
    raise NoRingError(f"{path}: tests are in {' or '.join(str(tests.relative_to(ROOT)) for tests in PLACES)}")


@cache
def ring_of(path: Path, test: str = "") -> Ring:
    """Of a file of tests, or of the function in it. Raises NoRingError."""
    file = name_of(path)
    for name in (f"{file}::{test}", file):
        named = [ring for ring, names in EXCEPTIONS.items() if name in names]
        if named:
            return named[0]
    folder = file.partition("/")[0]
    found = [ring for ring, folders in FOLDERS.items() if folder in folders]
    if not found:
        raise NoRingError(f"{file}: in which ring are its tests? Name its folder in tests/support/rings.py")
    return found[0]


def mark_rings(items: Iterable[pytest.Item]) -> None:
    """Each test gets the marker of its ring. Raises NoRingError."""
    for item in items:
        if not any(map(item.path.is_relative_to, PLACES)):
            continue  # a test of a test, elsewhere
        item.add_marker(getattr(pytest.mark, ring_of_case(item).value))


def ring_of_case(item: pytest.Item) -> Ring:
    """By its file, or for one of core by what it takes. Raises NoRingError."""
    ring = ring_of(item.path, getattr(item, "originalname", item.name))
    if ring is not Ring.CORE:
        return ring
    taken = set(getattr(item, "fixturenames", ()))
    parameters = getattr(item, "callspec", None)
    on_chip = parameters is not None and ON_CHIP in parameters.params.values()
    found = [Ring.CHIPS] * on_chip + [other for other in Ring if taken.intersection(FIXTURES[other])]
    return found[0] if found else ring
