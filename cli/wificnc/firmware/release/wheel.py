"""Wheels for one kind of computer: the package for all of them, and what was compiled for that one.

Binary distribution format: packaging.python.org/specifications/binary-distribution-format.
"""

from __future__ import annotations

import base64
import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

from wificnc.build.cross import build_platform, build_platform_program
from wificnc.build.native import SERVER, server_name
from wificnc.build.platforms import Platform

PURE_TAG = "py3-none-any"
FOLDER = "wificnc/native"  # wificnc.files.paths.NATIVE
PROGRAM_MODE = 0o100755 << 16


def wheel_tag(platform: Platform) -> str:
    return f"py3-none-{platform.wheel_tag}"


def native_files(root: Path, platform: Platform) -> dict[str, bytes]:
    """The library and the server program of a platform, name -> content. Raises BuildError."""
    build = build_platform(platform, root=root)
    server, _ = build_platform_program(build, root / "targets" / "pc" / "main.c", SERVER)
    return {platform.system.library: build.library.read_bytes(), server_name(platform.system): server.read_bytes()}


def platform_wheel(pure: Path, tag: str, native: Mapping[str, bytes]) -> bytes:
    """The wheel with this tag. @param pure  the wheel for every kind of computer. @param native  files that it adds"""
    packed = io.BytesIO()
    records: list[str] = []
    with zipfile.ZipFile(pure) as source, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as wheel:
        for entry in source.infolist():
            data = source.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                record = entry
                continue
            if entry.filename.endswith(".dist-info/WHEEL"):
                data = _for_one_computer(data, tag)
            wheel.writestr(entry, data)
            records.append(_record(entry.filename, data))
        for name, data in native.items():
            program = zipfile.ZipInfo(f"{FOLDER}/{name}", record.date_time)
            program.external_attr, program.compress_type = PROGRAM_MODE, zipfile.ZIP_DEFLATED
            wheel.writestr(program, data)
            records.append(_record(program.filename, data))
        wheel.writestr(record, "".join([*records, f"{record.filename},,\n"]))
    return packed.getvalue()


def _for_one_computer(text: bytes, tag: str) -> bytes:
    """The file WHEEL, with other words for the computer."""
    said = {b"Root-Is-Purelib": b"false", b"Tag": tag.encode()}
    lines = [line.partition(b": ") for line in text.splitlines()]
    return b"".join(name + colon + said.get(name, value) + b"\n" for name, colon, value in lines)


def _record(name: str, data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"
