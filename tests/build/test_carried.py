"""An installed package has no checkout: its sources are copied once, and its firmware is found."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.build import checkout
from wificnc.errors import BuildError
from wificnc.files import paths
from wificnc.firmware.flash.find import firmware_folder


@pytest.fixture
def carried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What a wheel carries, and a cache for it."""
    folder = tmp_path / "package" / "carried"
    (folder / "core").mkdir(parents=True)
    (folder / "core" / "config.h").write_text("#define A 1\n")
    monkeypatch.setattr(paths, "IS_CHECKOUT", False)
    monkeypatch.setattr(paths, "CARRIED", folder)
    monkeypatch.setattr(paths, "ROOT", folder)
    monkeypatch.setenv("WIFICNC_CACHE", str(tmp_path / "cache"))
    return folder


def test_builds_run_in_a_copy_that_stays(carried: Path, tmp_path: Path) -> None:
    root = checkout.checkout_root()
    assert root.parent == tmp_path / "cache" and (root / "core" / "config.h").read_text() == "#define A 1\n"
    (root / "build").mkdir()
    assert checkout.checkout_root() == root and (root / "build").is_dir()
    assert list(root.parent.iterdir()) == [root]  # nothing temporary is left


def test_other_sources_go_elsewhere(carried: Path) -> None:
    before = checkout.checkout_root()
    (carried / "core" / "config.h").write_text("#define A 2\n")
    after = checkout.checkout_root()
    assert after != before and (after / "core" / "config.h").read_text() == "#define A 2\n"


def test_who_comes_second_takes_the_copy_that_is_there(carried: Path) -> None:
    root = checkout.copied_tree(carried)
    checkout.copy_tree(carried, root)
    (root / "mark").touch()
    checkout.copy_tree(carried, root)
    assert (root / "mark").exists()


def test_a_cache_that_is_a_file_is_told(carried: Path, tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("")
    with pytest.raises(BuildError, match="cannot be copied") as caught:
        checkout.checkout_root()
    assert "WIFICNC_CACHE" in str(caught.value.hint)


def test_a_package_without_sources_says_how_to_get_them(carried: Path) -> None:
    (carried / "core" / "config.h").unlink()
    with pytest.raises(BuildError, match="C sources are missing") as caught:
        checkout.checkout_root()
    assert "install" in str(caught.value.hint)


@pytest.mark.parametrize(
    ("platform", "environment", "place"),
    [
        ("linux", {"XDG_CACHE_HOME": "/c"}, "/c/wificnc"),
        ("linux", {}, "~/.cache/wificnc"),
        ("darwin", {}, "~/Library/Caches/wificnc"),
        ("win32", {"LOCALAPPDATA": "/local"}, "/local/wificnc/cache"),
        ("linux", {"WIFICNC_CACHE": "/mine", "XDG_CACHE_HOME": "/c"}, "/mine"),
    ],
)
def test_the_cache_is_where_the_system_wants_it(platform: str, environment: dict[str, str], place: str) -> None:
    assert checkout.cache_directory(environment, platform) == Path(place).expanduser()


def test_firmware_of_ones_own_comes_before_the_packages(carried: Path) -> None:
    prebuilt = carried / "firmware" / "esp32s3-zero"
    prebuilt.mkdir(parents=True)
    (prebuilt / "build.json").write_text("{}")
    assert firmware_folder("esp32s3-zero") == prebuilt
    own = checkout.checkout_root() / "build" / "esp32s3-zero"
    assert firmware_folder("esp32s3-zero") == prebuilt  # the sources are there now, a build is not
    own.mkdir(parents=True)
    (own / "build.json").write_text("{}")
    assert firmware_folder("esp32s3-zero") == own


def test_a_checkout_knows_only_its_own_builds() -> None:
    assert firmware_folder("pic32mz2048efh100") == paths.CHECKOUT / "build" / "pic32mz2048efh100"
