"""NVS partition images, written by Espressif's own generator (PyPI: esp-idf-nvs-partition-gen)."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Iterable
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

from wificnc.errors import BuildError
from wificnc.firmware.nvs.image import Entry

PARTITION_SIZE = 0x6000  # targets/esp32/partitions.csv


def build_image(entries: Iterable[Entry], size: int = PARTITION_SIZE) -> bytes:
    """The partition. Raises BuildError when the generator is missing, or the entries do not fit."""
    try:
        from esp_idf_nvs_partition_gen import nvs_partition_gen as generator
    except ImportError as err:
        raise BuildError(
            "Espressif's NVS generator is not installed", hint="pip install esp-idf-nvs-partition-gen"
        ) from err
    with tempfile.TemporaryDirectory() as folder:
        table, image = Path(folder) / "nvs.csv", Path(folder) / "nvs.bin"
        table.write_text(csv_text(entries), encoding="utf-8")
        options = SimpleNamespace(input=str(table), output=image.name, size=hex(size), version=2, outdir=folder)
        before = os.getcwd()
        try:
            with redirect_stdout(io.StringIO()):  # it says where it wrote
                generator.generate(options)
        except (Exception, SystemExit) as err:
            raise BuildError(f"cannot make the NVS image: {err}") from err
        finally:
            os.chdir(before)
        return image.read_bytes()


def csv_text(entries: Iterable[Entry]) -> str:
    """The generator's input: namespaces, each followed by its keys."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("key", "type", "encoding", "value"))
    spaces: dict[str, list[Entry]] = {}
    for entry in entries:
        spaces.setdefault(entry.namespace, []).append(entry)
    for namespace, members in spaces.items():
        writer.writerow((namespace, "namespace", "", ""))
        for entry in members:
            if isinstance(entry.value, bytes):
                writer.writerow((entry.key, "data", "hex2bin", entry.value.hex()))
            else:
                writer.writerow((entry.key, "data", entry.type, entry.value))
    return out.getvalue()
