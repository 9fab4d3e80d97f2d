"""What goes into a chip's flash: from ELF, from and to Intel HEX. Addresses are physical."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from wificnc.errors import BuildError

ELF_MAGIC = b"\x7fELF\x01\x01"  # 32 bits, little-endian
PT_LOAD = 1
HEX_ROW = 16
HEX_DATA, HEX_END, HEX_UPPER = 0, 1, 4


@dataclass(frozen=True)
class Block:
    """Bytes that lie together."""

    address: int
    data: bytes

    @property
    def end(self) -> int:
        return self.address + len(self.data)


def read_elf(elf: bytes) -> tuple[Block, ...]:
    """The loadable blocks, in order of address. Raises BuildError."""
    blocks = [
        Block(physical, elf[offset : offset + size]) for offset, _, physical, size, _ in _segments(elf) if size > 0
    ]
    return tuple(sorted(blocks, key=lambda block: block.address))


def elf_symbols(elf: bytes) -> dict[str, int]:
    """Symbols with a name, by their value. Raises BuildError."""
    _check_elf(elf)
    shoff, entry, count = struct.unpack_from("<I", elf, 32)[0], *struct.unpack_from("<HH", elf, 46)
    sections = [struct.unpack_from("<10I", elf, shoff + index * entry) for index in range(count)]
    found = {}
    for section in sections:
        if section[1] != 2:  # SHT_SYMTAB
            continue
        names = sections[section[6]]
        for at in range(section[4], section[4] + section[5], 16):
            name, value = struct.unpack_from("<II", elf, at)
            start = names[4] + name
            found[elf[start : elf.index(b"\0", start)].decode()] = value
    return found


def _segments(elf: bytes) -> Iterator[tuple[int, int, int, int, int]]:
    """(offset, virtual, physical, size in the file, size in memory)"""
    _check_elf(elf)
    phoff, entry, count = struct.unpack_from("<I", elf, 28)[0], *struct.unpack_from("<HH", elf, 42)
    for index in range(count):
        kind, *rest = struct.unpack_from("<IIIIII", elf, phoff + index * entry)
        if kind == PT_LOAD:
            offset, virtual, physical, size, size_in_memory = rest
            yield offset, virtual, physical, size, size_in_memory


def _check_elf(elf: bytes) -> None:
    if not elf.startswith(ELF_MAGIC):
        raise BuildError("not a 32-bit little-endian ELF file")


# ---- Intel HEX ----


def write_hex(blocks: Iterable[Block]) -> str:
    """Intel HEX with upper addresses in records of type 4."""
    lines, upper = [], -1
    for block in blocks:
        for address, row in _rows(block):
            if address >> 16 != upper:
                upper = address >> 16
                lines.append(_record(HEX_UPPER, 0, upper.to_bytes(2, "big")))
            lines.append(_record(HEX_DATA, address & 0xFFFF, row))
    return "\n".join([*lines, _record(HEX_END, 0, b""), ""])


def _rows(block: Block) -> Iterator[tuple[int, bytes]]:
    """Rows that cross no multiple of HEX_ROW, and so none of 64 KB."""
    address = block.address
    while address < block.end:
        end = min(block.end, (address // HEX_ROW + 1) * HEX_ROW)
        yield address, block.data[address - block.address : end - block.address]
        address = end


def _record(kind: int, address: int, data: bytes) -> str:
    body = bytes([len(data), address >> 8, address & 0xFF, kind]) + data
    return f":{body.hex().upper()}{-sum(body) & 0xFF:02X}"


def read_hex(text: str) -> tuple[Block, ...]:
    """The blocks of a HEX file; neighbours become one. Raises BuildError."""
    blocks: list[Block] = []
    upper = 0
    for number, line in enumerate(text.split(), 1):
        kind, address, data = _parse_record(line, number)
        if kind == HEX_END:
            return tuple(blocks)
        if kind == HEX_UPPER:
            upper = int.from_bytes(data, "big") << 16
        elif kind == HEX_DATA and blocks and blocks[-1].end == upper + address:
            blocks[-1] = Block(blocks[-1].address, blocks[-1].data + data)
        elif kind == HEX_DATA:
            blocks.append(Block(upper + address, data))
        else:
            raise BuildError(f"line {number} of the HEX file: record type {kind} is not known")
    raise BuildError("the HEX file has no end record: it is cut off")


def _parse_record(line: str, number: int) -> tuple[int, int, bytes]:
    try:
        body = bytes.fromhex(line.removeprefix(":"))
    except ValueError:
        body = b""
    if not line.startswith(":") or len(body) < 5 or len(body) != body[0] + 5 or sum(body) & 0xFF:
        raise BuildError(f"line {number} of the HEX file is damaged: {line[:40]}")
    return body[3], body[1] << 8 | body[2], body[4:-1]
