"""Making what was planned: everything in a folder next to the output, which it replaces when it is complete."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wificnc.board import paths
from wificnc.board.model import Board
from wificnc.build.esp32 import SIGNATURE
from wificnc.build.pic32mz import build_pic32mz
from wificnc.errors import ReleaseError
from wificnc.firmware.flash.plan import Partition, read_partitions
from wificnc.firmware.release import flasher_page, linuxcnc, sbom
from wificnc.firmware.release.archive import tar_gz
from wificnc.firmware.release.esp32 import Esp32Firmware, load_firmware
from wificnc.firmware.release.notes import changes, notes_text
from wificnc.firmware.release.package import build_packages, carried_esp32
from wificnc.firmware.release.plan import ESP32_FILES, Asset, Plan
from wificnc.firmware.release.wheel import PURE_TAG, native_files, platform_wheel, wheel_tag
from wificnc.firmware.release.wmc3_header import protocol_header

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, unused-ignore]

SCHEMA = 1
PAGE = Path("web/dist")
PACKAGED_IMAGES = ("bootloader.bin", "partitions.bin", "firmware.bin", SIGNATURE)  # of an ESP32, in the package
PACKAGES = ("package", "source")  # kinds of files for Python
Say = Callable[[str], None]


@dataclass
class _Board:
    """What a board contributes."""

    board: Board
    assets: dict[str, bytes]  # suffix -> content
    carried: dict[str, bytes]  # in the package, path below firmware/
    page: dict[str, bytes]  # on the page, path below firmware/
    flash_mb: int | None = None
    tool: str = ""


@dataclass
class _Work:
    """Where it is made, and of what."""

    plan: Plan
    root: Path
    dist: Path
    temporary: Path
    final: bool
    boards: list[_Board] = field(default_factory=list)

    def write(self, suffix: str, data: bytes) -> None:
        (self.dist / f"wificnc-{self.plan.source.version}{suffix}").write_bytes(data)


def make_release(plan: Plan, root: Path, output: Path, *, final: bool = False, say: Say = lambda _: None) -> None:
    """Make dist/. @param final  the changelog must have a dated section. @param say  gets each step

    Raises:
        UserError: something is missing or damaged, or output holds what no release has made. Then output is as it was.
    """
    output = output.absolute()
    check_output(output)
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output.parent, prefix=f".{output.name}-") as temporary:
        work = _Work(plan, root, Path(temporary) / "dist", Path(temporary), final)
        work.dist.mkdir()
        _make(work, say)
        _check_complete(work)
        _replace(output, work.dist, Path(temporary) / "old")


def has_page(root: Path) -> bool:
    """Whether the flasher page has been built."""
    return (root / PAGE / "index.html").is_file()


def page_files(root: Path) -> dict[str, bytes]:
    """The built page, path -> content."""
    built = root / PAGE
    return {path.relative_to(built).as_posix(): path.read_bytes() for path in built.rglob("*") if path.is_file()}


def check_output(output: Path) -> None:
    """Whether it may be replaced. Raises ReleaseError."""
    if not output.exists() or (output.is_dir() and not any(output.iterdir())):
        return
    if not (output.is_dir() and (output / "release.json").is_file()):
        raise ReleaseError(
            f"{output} exists and is not a WiFiCNC release: it is not replaced", hint="-o, another folder"
        )


def _replace(output: Path, fresh: Path, old: Path) -> None:
    """Two renames; when the second one fails, the first is undone."""
    had = output.exists()
    if had:
        output.rename(old)
    try:
        fresh.rename(output)
    except BaseException:
        if had:
            old.rename(output)
        raise


def _make(work: _Work, say: Say) -> None:
    body = changes((work.root / "CHANGELOG.md").read_text(encoding="utf-8"), work.plan.source.version, final=work.final)
    partitions = read_partitions((paths.TARGETS / "esp32" / "partitions.csv").read_text(encoding="utf-8"))
    for board in work.plan.boards:
        say(board.id)
        work.boards.append(_esp32(work, board, partitions) if board.target == "esp32" else _pic32mz(work, board))
    for made in work.boards:
        for suffix, data in made.assets.items():
            work.write(f"-{made.board.id}{suffix}", data)
    say("packages")
    carried = {f"firmware/{name}": data for made in work.boards for name, data in made.carried.items()}
    carried |= {f"page/{name}": data for name, data in page_files(work.root).items()}
    build_packages(work.root, work.temporary, work.dist, carried, work.plan.source.epoch_s)
    _write_wheels(work, say)
    say("page, component, protocol")
    _write_page(work)
    _write_component(work)
    work.write("-protocol.h", protocol_header(work.root, work.plan.source.version).encode())
    _write_records(work, body)


def _write_wheels(work: _Work, say: Say) -> None:
    """Of each platform: the package, and the library and the server compiled for it."""
    pure = work.dist / f"wificnc-{work.plan.source.version}-{PURE_TAG}.whl"
    for platform in work.plan.platforms:
        say(f"wheel for {platform.name}")
        tag = wheel_tag(platform)
        work.write(f"-{tag}.whl", platform_wheel(pure, tag, native_files(work.root, platform)))


def _esp32(work: _Work, board: Board, partitions: dict[str, Partition]) -> _Board:
    folder = work.root / "build" / board.id
    firmware = load_firmware(folder, board, partitions)
    record = json.loads((folder / "build.json").read_text(encoding="utf-8"))
    return _Board(
        board,
        assets=_esp32_assets(firmware),
        carried=carried_esp32(board.id, record, folder, PACKAGED_IMAGES),
        page=flasher_page.esp32_files(board, work.plan.source.version, firmware),
        flash_mb=firmware.flash_mb,
        tool=f"esptool {importlib.metadata.version('esptool')}",
    )


def _esp32_assets(firmware: Esp32Firmware) -> dict[str, bytes]:
    regions = {f"-{flasher_page.file_name(region)}": region.data for region in firmware.regions}
    whole = {"-merged.bin": firmware.merged, ".uf2": firmware.uf2, ".elf": firmware.elf}
    made = {**regions, **whole, "-firmware.sig": firmware.signature}
    return {suffix: made[suffix] for suffix in ESP32_FILES}


def _pic32mz(work: _Work, board: Board) -> _Board:
    build = build_pic32mz(board, cc="gcc", root=work.root)
    image = build.hex.read_bytes()
    files = {f"{board.id}/wificnc.hex": image}
    return _Board(board, {".hex": image, ".elf": build.elf.read_bytes()}, files, files, tool=build.compiler)


def _write_page(work: _Work) -> None:
    """dist/web and its archive: the page when it has been built, and what it offers."""
    files = page_files(work.root)
    rows = [flasher_page.index_row(made.board, made.page, None, made.flash_mb) for made in work.boards]
    rows += [flasher_page.index_row(row.board, {}, row.why, None) for row in work.plan.missing]
    source = work.plan.source
    rows.sort(key=lambda row: str(row["id"]))
    files["firmware/index.json"] = flasher_page.index(source.version, source.revision, rows)
    files |= {f"firmware/{name}": data for made in work.boards for name, data in made.page.items()}
    for name, data in files.items():
        path = work.dist / "web" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    packed = {f"web/{name}": data for name, data in files.items()}
    work.write("-web.tar.gz", tar_gz(packed, source.epoch_s))


def _write_component(work: _Work) -> None:
    source = work.plan.source
    files = linuxcnc.component_files(work.root, source.version)
    work.write("-linuxcnc.tar.gz", tar_gz(files, source.epoch_s))


def _write_records(work: _Work, body: str) -> None:
    """The bill of materials knows the files before it, release.json those and it, the sums all but themselves."""
    source, dist = work.plan.source, work.dist
    missing = {row.board.id: row.why for row in work.plan.missing}
    assets = [(asset, _sha256(dist / asset.name)) for asset in work.plan.assets if (dist / asset.name).is_file()]
    work.write(".spdx.json", sbom.document(source, sbom.Materials(assets, _parts(work), _copyright(work.root))))
    (dist / "RELEASE_NOTES.md").write_text(notes_text(source.version, source.revision, body, missing), "utf-8")
    (dist / "release.json").write_bytes(flasher_page.json_bytes(_record(work, missing)))
    names = sorted(path.name for path in dist.iterdir() if path.is_file())
    (dist / "SHA256SUMS").write_text("".join(f"{_sha256(dist / name)}  {name}\n" for name in names), encoding="utf-8")


def _record(work: _Work, missing: Mapping[str, str]) -> dict[str, Any]:
    source = work.plan.source
    assets = [asset for asset in work.plan.assets if (work.dist / asset.name).is_file()]
    built = {made.board.id: {"state": "built", "with": made.tool} for made in work.boards}
    return {
        "schema": SCHEMA,
        "name": "wificnc",
        "version": source.version,
        "revision": source.revision,
        "date": sbom.utc(source.epoch_s),
        "packaged_with": f"hatchling {importlib.metadata.version('hatchling')}",
        "boards": dict(
            sorted({**built, **{n: {"state": "missing", "why": why} for n, why in missing.items()}}.items())
        ),
        "files": [_file_row(asset, work.dist / asset.name) for asset in assets],
    }


def _file_row(asset: Asset, path: Path) -> dict[str, Any]:
    row = {"name": asset.name, "kind": asset.kind, "board": asset.board, "what": asset.what}
    return {**row, "size": path.stat().st_size, "sha256": _sha256(path)}


def _parts(work: _Work) -> list[sbom.Part]:
    """What others made and we use."""
    assets = work.plan.assets
    packages = tuple(asset.name for asset in assets if asset.name.startswith("wificnc-") and asset.kind in PACKAGES)
    pages = tuple(asset.name for asset in assets if asset.kind == "page")
    esp32 = {board.id for board in work.plan.boards if board.target == "esp32"}
    images = tuple(asset.name for asset in assets if asset.board in esp32)
    project = tomllib.loads((work.root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    parts = sbom.python_parts(project["dependencies"], packages)
    parts += sbom.platform_part((work.root / "platformio.ini").read_text(encoding="utf-8"), images)
    lock = work.root / "web" / "package-lock.json"
    if lock.is_file() and has_page(work.root):
        parts += sbom.npm_parts(json.loads(lock.read_text(encoding="utf-8")), pages)
    return parts


def _copyright(root: Path) -> str:
    lines = (root / "LICENSE").read_text(encoding="utf-8").splitlines()
    return next((line.strip() for line in lines if line.startswith("Copyright")), sbom.NO_ANSWER)


def _check_complete(work: _Work) -> None:
    """What was made is what was planned. Anything else is a mistake of ours."""
    made = {path.name for path in work.dist.iterdir() if path.is_file()}
    planned = {asset.name for asset in work.plan.assets}
    if made != planned:
        raise AssertionError(f"the release differs from its plan: {sorted(made ^ planned)}")


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
