"""A chip at a serial port, through esptool's Python interface: the only place that knows it."""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from wificnc.connection.transport import SerialTransport
from wificnc.errors import FlashError, LinkError
from wificnc.firmware.flash.plan import Chip, Region

ROM_BAUD = 115200
SECTOR = 4096
MB = 1 << 20

Progress = Callable[[str, int, int], None]  # what, bytes done, of bytes

BOOT_HINT = "hold the board's BOOT button, press RESET, release BOOT, and try again"
AGAIN_HINT = "nothing else was changed; run the same command again, it starts from the beginning"


def _esptool() -> Any:
    """The module. Raises FlashError when it is not installed."""
    try:
        import esptool
        import esptool.cmds
    except ImportError as err:
        raise FlashError("esptool is not installed", hint="pip install 'esptool>=5,<6'") from err
    return esptool


def quiet_esptool() -> Any:
    """esptool without its words, for work on files. Raises FlashError when it is not installed."""
    esptool = _esptool()
    _listen(esptool)
    return esptool


class Device:
    """An ESP32 in its loader."""

    def __init__(self, loader: Any, port: str) -> None:
        self._loader = loader
        self.port = port
        self._cmds = _esptool().cmds

    def identify(self) -> Chip:
        """Chip, revision, flash and PSRAM. Nothing is written."""
        with _told(self.port, "read"):
            self._cmds.attach_flash(self._loader)
            size = self._cmds.detect_flash_size(self._loader)
            features = [str(feature) for feature in self._loader.get_chip_features()]
            major, minor = self._loader.get_major_chip_version(), self._loader.get_minor_chip_version()
            psram = next((match for text in features if (match := re.match(r"Embedded PSRAM (\d+)MB", text))), None)
            return Chip(
                name=self._loader.CHIP_NAME.lower().replace("-", ""),
                title=str(self._loader.get_chip_description()),
                revision=f"v{major}.{minor}",
                flash_mb=_size_mb(size),
                psram_mb=int(psram[1]) if psram else 0,
                psram_1v8=any("PSRAM" in text and "1v8" in text for text in features),
                mac=":".join(f"{byte:02x}" for byte in self._loader.read_mac("BASE_MAC")),
            )

    def write(self, regions: Sequence[Region], baud: int, progress: Progress) -> None:
        """Write them all; each is compared by its digest when it is written. Raises FlashError."""
        with _told(self.port, "write", progress):
            if baud != ROM_BAUD:
                self._loader.change_baud(baud)
            for region in regions:
                _Log.region = region
                self._cmds.write_flash(self._loader, [(region.offset, region.data)])

    def erase(self) -> None:
        """All of the flash, settings too."""
        with _told(self.port, "erase"):
            self._cmds.erase_flash(self._loader)

    def verify(self, regions: Sequence[Region]) -> None:
        """Compare digests of what the flash holds now. Raises FlashError naming what differs."""
        with _told(self.port, "read"):
            for region in regions:
                found = str(self._loader.flash_md5sum(region.offset, len(region.data)))
                if found != hashlib.md5(region.data).hexdigest():
                    raise FlashError(
                        f"{region.name} was not written correctly: the flash contains different data", AGAIN_HINT
                    )

    def read(self, offset: int, size: int) -> bytes:
        with _told(self.port, "read"):
            return bytes(self._loader.read_flash(offset, size))

    def reset(self) -> None:
        """Start the firmware."""
        with _told(self.port, "reset"):
            self._cmds.reset_chip(self._loader, "hard-reset")


@contextlib.contextmanager
def open_device(port: str, reset_first: bool = True) -> Iterator[Device]:
    """Connect to the chip's loader. Raises FlashError: no port, no permission, no answer."""
    esptool = _esptool()
    try:
        SerialTransport(port, ROM_BAUD).close()
    except LinkError as err:
        raise FlashError(err.message, err.hint) from err
    with _told(port, "connect"):
        mode = "default-reset" if reset_first else "no-reset"
        loader = esptool.cmds.detect_chip(port, ROM_BAUD, mode)
        connected = loader
        try:
            loader = esptool.cmds.run_stub(loader)
        except BaseException:
            connected._port.close()
            raise
    try:
        yield Device(loader, port)
    finally:
        with contextlib.suppress(Exception):
            loader._port.close()


class _Log:
    """Where esptool's progress goes while we use it."""

    installed = False
    region: Region | None = None
    progress: Progress | None = None


@contextlib.contextmanager
def _told(port: str, verb: str, progress: Progress | None = None) -> Iterator[None]:
    """esptool keeps quiet; its errors become ours."""
    esptool = _esptool()
    import serial

    before = _Log.progress
    _Log.progress = progress
    _listen(esptool)
    try:
        yield
    except FlashError:
        raise
    except (serial.SerialException, OSError) as err:
        raise FlashError(f"{port} was lost while it was used to {verb}: {err}", AGAIN_HINT) from err
    except Exception as err:
        if not _is_esptools(esptool, err):
            raise
        raise FlashError(_words(port, verb, err), BOOT_HINT if verb == "connect" else AGAIN_HINT) from err
    finally:
        _Log.progress = before


def _is_esptools(esptool: Any, err: Exception) -> bool:
    module = type(err).__module__.split(".")[0]
    return isinstance(err, esptool.FatalError) or module in ("esptool", "esp_pylib")


def _words(port: str, verb: str, err: Exception) -> str:
    first = str(err).strip().splitlines()[0] if str(err).strip() else type(err).__name__
    return f"cannot {verb} at {port}: {first}"


def _listen(esptool: Any) -> None:
    """Our logger, once: bars to the progress function, words to no one."""
    if _Log.installed:
        return
    from esptool.logger import EsptoolLogger, TemplateLogger, log

    class Quiet(TemplateLogger):  # type: ignore[misc, unused-ignore]
        def print(self, *args: Any, **kwargs: Any) -> None:
            pass

        def note(self, message: str) -> None:
            pass

        def warning(self, message: str) -> None:
            pass

        def error(self, message: str) -> None:
            pass

        def stage(self, finish: bool = False) -> None:
            pass

        def progress_bar(self, cur_iter: int, total_iters: int, *_: Any, **__: Any) -> None:
            if _Log.progress is not None and _Log.region is not None and total_iters > 0:
                size = len(_Log.region.data)  # esptool counts compressed bytes
                _Log.progress(_Log.region.name, cur_iter * size // total_iters, size)

        def set_verbosity(self, verbosity: str) -> None:
            pass

    # Not log.set_logger(): when another of Espressif's packages has logged before, that is esp-pylib's own method,
    # which refuses a TemplateLogger.
    EsptoolLogger.set_logger(log, Quiet())
    _Log.installed = True


def _size_mb(size: str | None) -> float:
    """ "4MB" -> 4. Raises FlashError when the flash does not say."""
    match = re.fullmatch(r"(\d+)(K|M)B", size or "")
    if match is None:
        raise FlashError("the flash does not report its size", hint="check the module and its solder joints")
    return int(match[1]) / (1024 if match[2] == "K" else 1)
