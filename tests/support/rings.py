"""The ring of each test, by what it touches: decided here alone, by folder, with exceptions by file.

- core: virtual time on the host library, the command line in the test's own process, generators, boards. It cannot
  fail because a computer is busy: what waits for a clock is refused while it runs (tests/support/core_only.py).
- chips: virtual chips, objects for their processors, wheels, releases, other platforms. Processes, but no clock.
- realtime: browsers, sockets, pseudo-terminals, LinuxCNC, senders, served controllers.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]


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
    Ring.CHIPS: ("budget", "build", "esp32", "espsim", "mips", "mzsim", "native", "pic32mz", "release", "xtensa"),
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
        "repo/test_dev.py::test_each_test_file_is_compiled_once_and_not_again",
        "repo/test_patience.py::test_a_program_under_test_gets_its_signals_whatever_we_inherit",
        "settings/test_settings_generate.py::test_what_is_committed_is_fresh",
        "settings/test_store_migration.py::test_pages_of_a_virtual_chip_of_before",
        "settings/test_store_migration.py::test_pic32mz_pages_of_layout_1",
        "states/test_states_on_chip.py",
        "wire/test_access.py::test_a_siphash_is_that_of_another_implementation",
    ),
    Ring.REALTIME: (
        "linuxcnc/test_linuxcnc_module.py::test_a_module_in_halrun",
        "linuxcnc/test_linuxcnc_config.py::test_a_configuration_is_paired_once_the_controller_has_accepted_the_key",
        "linuxcnc/test_linuxcnc_config.py::test_linuxcnc_moves_a_machine_to_the_step",
        "linuxcnc/test_linuxcnc_source.py::test_halcompile_builds_it_without_a_warning",
        *("drivers/test_drivers_cli.py", "spindle/test_drive_served.py", "tune/test_tune_send.py"),
        "link/test_expand.py::test_send_expands",
        "link/test_expand.py::test_send_names_the_line_of_the_file",
        *(f"link/test_{name}.py" for name in ("commands", "condition", "discover", "doctor", "keyboard", "serve_link")),
        *(f"link/test_{name}.py" for name in ("resume_hint", "stream_core", "transport")),
        *(f"esp32/test_{name}.py" for name in ("first_contact", "ota", "page", "shut_out", "telnet", "update_page")),
        *(f"wire/test_{name}.py" for name in ("foreign_client", "lossy", "serve_access", "serve_wire", "wmc3_cli")),
        "wire/test_leases.py::test_a_closed_port_ends_its_reports",
        "wire/test_leases.py::test_a_closed_port_does_not_end_those_of_the_host_in_control",
        "wire/test_leases.py::test_an_answer_that_waits_costs_no_processor_time",
        "cli/test_keys.py::test_the_key_of_the_environment_logs_in",
    ),
}

# A case that runs in a virtual chip, wherever its test is: of a parameter with this value.
ON_CHIP = "chip"


class NoRingError(pytest.UsageError):
    """A test file of which this table says nothing."""


def ring_of(path: Path, test: str = "") -> Ring:
    """Of a file of tests, or of the function in it. Raises NoRingError."""
    file = path.relative_to(TESTS).as_posix()
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
    known: dict[tuple[Path, str], Ring] = {}
    for item in items:
        if not item.path.is_relative_to(TESTS):
            continue  # a test of a test, elsewhere
        function = getattr(item, "originalname", item.name)
        key = (item.path, function)
        if key not in known:
            known[key] = ring_of(*key)
        parameters = getattr(item, "callspec", None)
        on_chip = parameters is not None and ON_CHIP in parameters.params.values()
        ring = Ring.CHIPS if known[key] is Ring.CORE and on_chip else known[key]
        item.add_marker(getattr(pytest.mark, ring.value))
