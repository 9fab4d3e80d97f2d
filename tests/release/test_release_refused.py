"""What is missing, damaged or of something else is reported, and nothing is written."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from esp_images import TABLE_ROWS, elf, image, make_build, partition_table, write_record
from made_key import pem
from release_tree import Tree
from wificnc import __version__
from wificnc.board.load import load_board
from wificnc.build.signing import VARIABLE
from wificnc.errors import Exit, FlashError, ReleaseError
from wificnc.files import paths
from wificnc.firmware.flash.plan import read_partitions
from wificnc.firmware.release.esp32 import load_firmware
from wificnc.firmware.release.facts import read_source
from wificnc.firmware.release.notes import changes
from wificnc.firmware.release.plan import Source, plan_release
from wificnc.firmware.release.run import check_output, make_release

BOARD, CHIP = "esp32s3-zero", "esp32s3"
PARTITIONS = read_partitions((paths.ROOT / "targets/esp32/partitions.csv").read_text())
SOURCE = Source("1.2.3", "abcdef012345", 1_700_000_000)
BOARDS = [load_board(name) for name in ("esp32-wroom32", "esp32s3-zero", "pic32mz2048efh100")]


def flip(path: Path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 0x01
    path.write_bytes(data)


def resum(folder: Path) -> None:
    write_record(folder, BOARD, SOURCE.revision)


def harm_checksum(folder: Path) -> None:
    """A wrong byte of code in an image that keeps no digest: only the checksum can tell."""
    path = folder / "firmware.bin"
    data = bytearray(path.read_bytes()[:-32])
    data[23] = 0
    data[1000] ^= 0x10
    path.write_bytes(data)
    resum(folder)


def harm_digest(folder: Path) -> None:
    """An entry point that the checksum does not cover."""
    flip(folder / "firmware.bin", 4)
    resum(folder)


def no_digest(folder: Path) -> None:
    path = folder / "firmware.bin"
    data = bytearray(path.read_bytes()[:-32])
    data[23] = 0
    path.write_bytes(data)
    resum(folder)


def cut(folder: Path) -> None:
    path = folder / "bootloader.bin"
    path.write_bytes(path.read_bytes()[:200])
    resum(folder)


def other_chip(folder: Path) -> None:
    image(folder, "firmware", "esp32", elf("esp32", b"wificnc", 60_000))
    resum(folder)


def other_firmware(folder: Path) -> None:
    image(folder, "firmware", CHIP, elf(CHIP, b"hello_world", 60_000))
    resum(folder)


def more_flash(folder: Path) -> None:
    image(folder, "bootloader", CHIP, elf(CHIP, None, 8000), flash_mb=8)
    resum(folder)


def other_table(folder: Path) -> None:
    (folder / "partitions.bin").write_bytes(partition_table([*TABLE_ROWS[:3], ("ota_0", 0, 0x10, 0x10000, 0x1F0000)]))
    resum(folder)


def damaged_table(folder: Path) -> None:
    flip(folder / "partitions.bin", 6)
    resum(folder)


def no_table(folder: Path) -> None:
    (folder / "partitions.bin").write_bytes(bytes(0xC00))
    resum(folder)


HARMS: list[tuple[Callable[[Path], object], str]] = [
    (lambda folder: (folder / "bootloader.bin").unlink(), "is incomplete"),
    (lambda folder: (folder / "firmware.elf").unlink(), "is incomplete"),
    (lambda folder: (folder / "build.json").write_text("{"), "is incomplete"),
    (lambda folder: flip(folder / "firmware.bin", 1000), "differs from the build record"),
    (lambda folder: write_record(folder, "esp32-wroom32", ""), "a build of esp32-wroom32"),
    (harm_checksum, "the firmware of esp32s3-zero is damaged: its checksum"),
    (harm_digest, "SHA-256"),
    (no_digest, "SHA-256"),
    (cut, "bootloader"),
    (other_chip, "is for esp32, not for esp32s3"),
    (other_firmware, "not a WiFiCNC firmware"),
    (more_flash, "built for 8 MB of flash"),
    (other_table, "is not the table of targets/esp32/partitions.csv"),
    (damaged_table, "its MD5 differs"),
    (no_table, "the partition table is invalid"),
]


@pytest.mark.parametrize(("harm", "said"), HARMS, ids=[getattr(harm, "__name__", said) for harm, said in HARMS])
def test_a_build_that_is_not_right(tmp_path: Path, harm: Callable[[Path], object], said: str) -> None:
    folder = make_build(tmp_path / BOARD, BOARD, CHIP, SOURCE.revision)
    load_firmware(folder, load_board(BOARD), PARTITIONS)  # it was right
    harm(folder)
    with pytest.raises((FlashError, ReleaseError)) as caught:
        load_firmware(folder, load_board(BOARD), PARTITIONS)
    assert said in caught.value.message


def test_a_board_that_names_no_flash_sizes(tmp_path: Path) -> None:
    folder, board = make_build(tmp_path / BOARD, BOARD, CHIP, SOURCE.revision), load_board(BOARD)
    board = board.model_copy(update={"memory": board.memory.model_copy(update={"flash_mb": ()})})
    with pytest.raises(ReleaseError) as caught:
        load_firmware(folder, board, PARTITIONS)
    assert "memory.flash_mb" in caught.value.message + str(caught.value.hint)


def test_nothing_half_is_left_and_the_old_release_stays(tree: Tree, tmp_path: Path) -> None:
    """The firmware of one board is damaged; the release before it is as it was."""
    output = tmp_path / "out"
    output.mkdir()
    (output / "release.json").write_text("{}")
    root = tmp_path / "root"
    make_build(root / "build" / BOARD, BOARD, CHIP, SOURCE.revision)
    (root / "CHANGELOG.md").write_text("## [Unreleased]\n\n- It works.\n")
    flip(root / "build" / BOARD / "firmware.bin", 1000)
    plan = plan_release(SOURCE, BOARDS, {}, [BOARD])
    with pytest.raises(FlashError, match="differs from the build record"):
        make_release(plan, root, output)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "root"]
    assert [path.name for path in output.iterdir()] == ["release.json"]


def test_a_folder_of_somebody_else_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("all my work")
    with pytest.raises(ReleaseError, match="not a WiFiCNC release"):
        check_output(tmp_path)
    check_output(tmp_path / "fresh")
    (tmp_path / "empty").mkdir()
    check_output(tmp_path / "empty")


def test_a_board_that_was_asked_for_must_be_there(tree: Tree) -> None:
    said = tree.release("--boards", "esp32s3-zero,esp32s3-devkitc", "-o", "other", code=Exit.BUILD).stderr
    assert "esp32s3-devkitc: its compiler comes from Espressif's download servers" in said
    assert not (tree.root / "other").exists()
    assert "no board with firmware: esp32s9" in tree.release("--boards", "esp32s9", code=Exit.BUILD).stderr


def test_a_debug_build_is_no_release(tree: Tree) -> None:
    folder = make_build(tree.root / "build" / "esp32s3-devkitc", "esp32s3-devkitc", CHIP, tree.revision)
    record = json.loads((folder / "build.json").read_text())
    (folder / "build.json").write_text(json.dumps({**record, "kind": "debug"}))
    try:
        said = tree.release("--boards", "esp32s3-devkitc", code=Exit.BUILD).stderr
    finally:
        shutil.rmtree(folder)
    assert "it is a debug build: `wificnc build esp32s3-devkitc`" in " ".join(said.split())


def test_firmware_of_another_commit_is_none(tree: Tree) -> None:
    folder = make_build(tree.root / "build" / "esp32s3-devkitc", "esp32s3-devkitc", CHIP, "0123456789ab")
    try:
        said = tree.release("--boards", "esp32s3-devkitc", code=Exit.BUILD).stderr
    finally:
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()
    assert f"it was built from 0123456789ab, and this is {tree.revision}" in said


def test_without_wishes_what_is_missing_is_left_out() -> None:
    plan = plan_release(SOURCE, BOARDS, {"esp32-wroom32": "why"})
    assert [board.id for board in plan.boards] == ["esp32s3-zero", "pic32mz2048efh100"]
    assert [(row.board.id, row.why) for row in plan.missing] == [("esp32-wroom32", "why")]


def test_a_final_release_is_of_its_tag_and_of_a_commit() -> None:
    plan_release(SOURCE, BOARDS, {}, tag="v1.2.3")
    with pytest.raises(ReleaseError, match=r"the tag is v1\.2\.4, and the version 1\.2\.3"):
        plan_release(SOURCE, BOARDS, {}, tag="v1.2.4")
    with pytest.raises(ReleaseError, match="parts of the release are missing:\n  esp32-wroom32: why"):
        plan_release(SOURCE, BOARDS, {"esp32-wroom32": "why"}, tag="v1.2.3")
    with pytest.raises(ReleaseError, match="clean tree"):
        plan_release(Source("1.2.3", "abcdef012345+", 0), BOARDS, {}, tag="v1.2.3")


def test_two_files_never_share_a_name() -> None:
    names = [asset.name for asset in plan_release(SOURCE, BOARDS, {}).assets]
    assert len(names) == len(set(names)) == 8 + 8 + 2 + 8 + 3


def test_times_are_the_commits_or_those_asked_for(tree: Tree, tmp_path: Path) -> None:
    committed = read_source(tree.root, {})
    assert (committed.revision, committed.epoch_s) == (tree.revision, 1793534400) and committed.is_clean
    assert read_source(tree.root, {"SOURCE_DATE_EPOCH": "1700000000"}).epoch_s == 1_700_000_000
    with pytest.raises(ReleaseError, match="SOURCE_DATE_EPOCH is 'yesterday'"):
        read_source(tree.root, {"SOURCE_DATE_EPOCH": "yesterday"})
    with pytest.raises(ReleaseError, match="not a git repository"):
        read_source(tmp_path, {})


def test_a_final_release_has_the_page(tree: Tree) -> None:
    index = tree.root / "web" / "dist" / "index.html"
    hidden = index.rename(index.with_name("hidden"))
    try:
        words = ["--boards", "esp32s3-zero", "--tag", f"v{__version__}", "-o", "final"]
        assert "the page has not been built" in tree.release(*words, code=Exit.BUILD).stderr
    finally:
        hidden.rename(index)


CHANGELOG = """\
# Changelog

## [Unreleased]

- To come.

## [1.2.3] - 2026-11-01

### Added

- This.

## [1.2.2]

- That.
"""


def test_notes_are_the_versions_section() -> None:
    assert changes(CHANGELOG, "1.2.3", final=True) == "### Added\n\n- This."
    assert changes(CHANGELOG, "1.3.0", final=False) == "- To come."
    assert changes(CHANGELOG, "1.2.2", final=False) == "- That."
    with pytest.raises(ReleaseError, match=r"no dated section of 1\.2\.2"):
        changes(CHANGELOG, "1.2.2", final=True)
    with pytest.raises(ReleaseError, match=r"no dated section of 1\.3\.0") as caught:
        changes(CHANGELOG, "1.3.0", final=True)
    assert "[1.3.0] - YYYY-MM-DD" in str(caught.value.hint)
    with pytest.raises(ReleaseError, match="neither"):
        changes("# Changelog\n", "1.0.0", final=False)


def test_firmware_of_another_signing_key_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose boards the next release could not update."""
    folder = make_build(tmp_path, BOARD, CHIP, "")
    load_firmware(folder, load_board(BOARD), PARTITIONS)
    monkeypatch.setenv(VARIABLE, pem(21))
    with pytest.raises(ReleaseError, match="is not signed with the key"):
        load_firmware(folder, load_board(BOARD), PARTITIONS)


def test_improv_is_offered_when_the_firmware_speaks_it(tmp_path: Path) -> None:
    from wificnc.firmware.release.flasher_page import manifest

    board = load_board(BOARD)
    folder = make_build(tmp_path, BOARD, CHIP, "")
    assert manifest(board, "1", load_firmware(folder, board, PARTITIONS))["new_install_improv_wait_time"] == 0
    image(folder, "firmware", CHIP, elf(CHIP, b"wificnc", 60_000).replace(b"v5.5.3", b"IMPROV"))
    write_record(folder, BOARD, "")
    assert manifest(board, "1", load_firmware(folder, board, PARTITIONS))["new_install_improv_wait_time"] > 0


def test_the_record_names_a_damaged_one_too(tmp_path: Path) -> None:
    """A build.json that cannot be read is reported by the release itself, not taken for a missing build."""
    from wificnc.firmware.release.facts import look

    folder = tmp_path / "build" / BOARD
    folder.mkdir(parents=True)
    (folder / "build.json").write_text("[]")
    assert look(tmp_path, SOURCE, [load_board(BOARD)]) == {}
    (folder / "build.json").write_text(json.dumps({"revision": SOURCE.revision}))
    assert look(tmp_path, SOURCE, [load_board(BOARD)]) == {}
