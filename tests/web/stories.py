"""The tests with a browser that each run of CI does: whole stories of a user. The others are deep (the slices of CI):
each is a variant of one of these, or its logic is looked at in web/'s unit tests, or in tests/grbl and tests/link."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from sample import sampled

NO_BROWSER = ("test_board_page.py", "test_core.py", "test_page_server.py", "test_units.py")
CASES = 1  # of each story: one way of connecting, one screen, one language

STORIES = {
    "test_console.py": (
        *("home_and_jog", "overrides_and_alarm", "settings_round_trip", "a_whole_job_with_a_hold_in_the_middle"),
        *("a_refused_line_stops_the_job_and_keeps_the_position", "stop", "the_link_is_lost_and_the_job_resumed"),
        *("done_is_what_was_cut_and_not_what_was_acknowledged", "go_to_zero_without_homing_asks_and_never_goes_down"),
        *("a_second_page_watches_and_takes_over", "an_access_key_is_asked_for"),
    ),
    "test_first_contact.py": (
        "a_phone_gives_the_controller_its_network_and_keeps_it",
        "it_fits_a_phone_and_has_no_fault_of_accessibility",
    ),
    "test_install.py": (
        *("a_board_is_installed", "another_chip_is_refused_before_anything_is_written", "unplugged_in_the_middle"),
        "pins_are_read_from_a_board_and_written_back",
    ),
    "test_known.py": (
        *("the_work_system_that_a_job_leaves", "a_setting_of_the_terminal_is_seen_by_the_settings"),
        *("leaving_a_machine_at_work_is_asked_for", "a_lost_link_comes_back_by_itself_and_nothing_continues"),
    ),
    "test_page_axes.py": ("it_homes_and_zeroes_these_axes_alone",),
    "test_page_drives.py": ("drivers_are_shown_changed_and_verified",),
    "test_page_guide.py": ("a_machine_is_set_up_step_by_step", "a_settings_file_sets_the_machine_up"),
    "test_page_import.py": ("a_machine_profile_is_shown_and_written", "a_broken_profile_changes_nothing"),
    "test_page_language.py": ("every_tab_is_in_the_language_of_the_browser", "another_language_is_chosen_in_the_page"),
    "test_page_latency.py": ("two_presses_of_undo_are_two_steps_back",),
    "test_page_offline.py": (
        "it_starts_without_a_network",
        "a_newer_version_comes_whole_and_with_the_next_start",
    ),
    "test_page_on_chip.py": ("it_loads_shows_jogs_and_cuts",),
    "test_page_outline.py": ("the_outline_is_run_and_a_job_starts_at_a_line",),
    "test_page_parked.py": ("a_tool_is_changed_with_the_page",),
    "test_page_phone.py": ("nothing_reaches_out_of_its_card", "two_fingers_zoom_the_path_and_one_moves_it"),
    "test_page_pins.py": ("a_pin_is_moved_over_the_network", "a_refusal_is_shown_and_the_choice_stays"),
    "test_page_presses.py": (
        *("no_notice_moves_a_control", "a_second_press_neither_stops_nor_starts"),
        *("a_held_key_and_a_double_click_start_once", "a_held_jog_ends_at_the_soft_limit"),
    ),
    "test_page_probe.py": (
        "z_is_probed_shown_and_undone",
        "a_tool_length_is_measured_against_the_reference_and_undone",
    ),
    "test_page_reload.py": ("a_job_is_resumed_after_a_reload",),
    "test_page_shortcuts.py": (
        *("a_stored_position_is_set_and_reached_with_z_up", "a_macro_runs_is_kept_changed_and_deleted"),
        *("the_laser_is_lit_only_while_the_button_is_held", "the_beam_ends_with_the_link_and_the_dialog"),
    ),
    "test_page_tools.py": ("a_tool_is_stored_while_the_job_waits_for_it",),
    "test_page_update.py": (
        "a_firmware_is_installed_and_reached",
        "firmware_for_another_board_is_installed_only_on_purpose",
    ),
    "test_page_zero.py": ("positions_are_typed_halved_zeroed_and_undone",),
    "test_preflight.py": ("soft_limits_are_those_of_the_machine_with_its_work_zero", "an_offset_of_g92"),
    "test_provision.py": ("a_network_is_joined", "a_refusal_in_words"),
    "test_screens.py": (
        *("every_tab", "what_a_job_forbids", "every_dialog_fits_the_screen", "the_first_load_is_small"),
        "the_path_in_three_dimensions",
    ),
    "test_states_table_page.py": ("rows_are_found_by_state_and_words",),
}


def mark_stories(items: Iterable[pytest.Item], folder: Path) -> None:
    """Tests with a browser that are no story, and other cases of one, are deep."""
    of_browser = [item for item in items if item.path.parent == folder and item.path.name not in NO_BROWSER]
    stories = [item for item in of_browser if not item.get_closest_marker("deep") and is_story(item)]
    kept = sampled([item.nodeid for item in stories], CASES)
    for item in of_browser:
        if item.nodeid not in kept:
            item.add_marker(pytest.mark.deep)


def is_story(item: pytest.Item) -> bool:
    name = getattr(item, "originalname", item.name).removeprefix("test_")
    return name in STORIES.get(item.path.name, ())
