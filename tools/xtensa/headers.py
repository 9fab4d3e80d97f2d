"""Where the headers of ESP-IDF come from: our own small ones, or the real ones."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from wificnc.board.header import pin_header_text
from wificnc.board.load import find_boards, load_board
from wificnc.board.model import Board
from wificnc.build.esp32 import CONFIGURATION, Kind, configuration_lines
from wificnc.firmware.page_header import page_header_text

from xtensa.toolchain import LIBC_HEADERS

# chip -> a board that has it
BOARDS = {"esp32s3": "esp32s3-devkitc", "esp32": "esp32-wroom32"}
# chip -> a board whose axes its RMT has channels for
RMT_BOARDS = {"esp32s3": "esp32s3-zero", "esp32": "esp32-wroom32"}
# chip -> a board with shift registers
SHIFT_BOARDS = {"esp32s3": "esp32s3-devkitc-shift", "esp32": "mks-tinybee"}

# fmt: off
COMPONENT_FOLDERS = tuple("""
newlib/platform_include freertos/config/include freertos/config/include/freertos
freertos/config/xtensa/include freertos/FreeRTOS-Kernel/include
freertos/FreeRTOS-Kernel/portable/xtensa/include freertos/FreeRTOS-Kernel/portable/xtensa/include/freertos
freertos/esp_additions/include esp_hw_support/include esp_hw_support/include/soc esp_hw_support/port/CHIP/.
esp_hw_support/port/CHIP/include heap/include log/include soc/include soc/CHIP soc/CHIP/include
soc/CHIP/register hal/platform_port/include hal/CHIP/include hal/include esp_rom/include
esp_rom/CHIP/include esp_rom/CHIP/include/CHIP esp_rom/CHIP esp_common/include esp_system/include
esp_system/port/soc esp_system/port/include/private xtensa/include xtensa/CHIP/include
xtensa/deprecated_include lwip/include lwip/include/apps lwip/lwip/src/include lwip/port/include
lwip/port/freertos/include lwip/port/esp32xx/include lwip/port/esp32xx/include/arch
lwip/port/esp32xx/include/sys esp_driver_gpio/include esp_driver_ledc/include esp_driver_uart/include
esp_driver_usb_serial_jtag/include esp_timer/include esp_event/include esp_netif/include esp_wifi/include
esp_wifi/include/local esp_phy/include esp_phy/CHIP/include esp_coex/include
wpa_supplicant/esp_supplicant/include nvs_flash/include esp_partition/include spi_flash/include
esp_eth/include vfs/include esp_pm/include esp_ringbuf/include esp_driver_rmt/include esp_driver_spi/include
app_update/include bootloader_support/include esp_app_format/include esp_bootloader_format/include
esp_driver_pcnt/include esp_driver_mcpwm/include mbedtls/port/include mbedtls/mbedtls/include
""".split())  # noqa: SIM905
# fmt: on

# Debian's newlib declares one name otherwise than ESP-IDF does.
REENT_SHIM = """#define _global_impure_ptr _libc_global_impure_ptr
#include_next <sys/reent.h>
#undef _global_impure_ptr
"""


@dataclass(frozen=True)
class Headers:
    """What a compiler of the firmware needs in addition to our own folders."""

    generated: Path  # pin_config.h and sdkconfig.h
    system: tuple[Path, ...]
    flags: tuple[str, ...] = ()


def rmt_board(chip: str, output: Path) -> Board:
    """A board with step pulses by the RMT; none of ours asks for them."""
    return by_rmt(load_board(RMT_BOARDS[chip]), output)


def by_rmt(board: Board, output: Path) -> Board:
    """The same board with step pulses by the RMT."""
    text = board.path.read_text()
    text = text.replace("max_step_rate_hz = 250_000\n", 'max_step_rate_hz = 200_000\n\n[step]\nengine = "rmt"\n')
    output.mkdir(parents=True, exist_ok=True)
    (output / "rmt.toml").write_text(text)
    return load_board(output / "rmt.toml")


def other_boards(chip: str) -> list[Board]:
    """Our boards with this chip, next to that of BOARDS."""
    boards = [load_board(path) for path in find_boards()]
    return [board for board in boards if board.chip == chip and board.id != BOARDS[chip]]


def small_headers(root: Path, chip: str, output: Path, board: Board | None = None) -> Headers:
    """Our own declarations of what we use. @param board  None: that of BOARDS"""
    generated = generate_pins(board or load_board(BOARDS[chip]), output)
    lines = [f"#define CONFIG_IDF_TARGET_{chip.upper()} 1"]
    lines += [f"#define {name} {value}" for name, value in (("CONFIG_FREERTOS_HZ", 1000), _CPU)]
    (generated / "sdkconfig.h").write_text("\n".join([*lines, ""]))
    return Headers(generated, (root / "targets/esp32/test/idf_api", LIBC_HEADERS), ("-Wconversion",))


_CPU = ("CONFIG_ESP_DEFAULT_CPU_FREQ_MHZ", 240)


def real_headers(root: Path, idf: Path, chip: str, output: Path, board: Board | None = None) -> Headers:
    """ESP-IDF's own headers, with the configuration that our sdkconfig.defaults leads to."""
    generated = generate_pins(board or load_board(BOARDS[chip]), output)
    configure(root, idf, chip, generated)
    (generated / "shim/sys").mkdir(parents=True, exist_ok=True)
    (generated / "shim/sys/reent.h").write_text(REENT_SHIM)
    folders = [idf / "components" / folder.replace("CHIP", chip) for folder in COMPONENT_FOLDERS]
    system = (*(folder for folder in folders if folder.is_dir()), generated / "shim", LIBC_HEADERS)
    return Headers(generated, system, ('-DIDF_VER="v5.5.3"', "-DSOC_MMU_PAGE_SIZE=CONFIG_MMU_PAGE_SIZE"))


def with_pins(headers: Headers, generated: Path) -> Headers:
    """The same for another board of the chip. @param generated  its pin_config.h, before that of `headers`"""
    return replace(headers, generated=generated, system=(headers.generated, *headers.system))


def generate_pins(board: Board, output: Path) -> Path:
    """What board.cmake has `wificnc` write for a board. The page's files may be missing here, so they are none, and so
    is a key."""
    output.mkdir(parents=True, exist_ok=True)
    (output / "pin_config.h").write_text(pin_header_text(board))
    (output / "page_files.h").write_text(page_header_text(()))
    (output / "signing_key.h").write_text(f"#define SIGNING_KEY {', '.join(['4'] * 65)}\n")
    return output


def configure(root: Path, idf: Path, chip: str, output: Path, kind: Kind = "release") -> str:
    """sdkconfig.h by ESP-IDF's own kconfgen. @return what it said: unknown and renamed options of our defaults.

    Raises RuntimeError when it fails.
    """
    output.mkdir(parents=True, exist_ok=True)
    environment = _kconfig_environment(idf, chip, output)
    (output / "env.json").write_text(json.dumps(environment))
    prepare = idf / "tools/kconfig_new/prepare_kconfig_files.py"
    names = ("sdkconfig.defaults", f"sdkconfig.defaults.{chip}", f"sdkconfig.{kind}")
    defaults = [root / CONFIGURATION / name for name in names]
    (output / "sdkconfig").unlink(missing_ok=True)
    said = ""
    for command in (
        [sys.executable, str(prepare), "--list-separator=semicolon", "--env-file", str(output / "env.json")],
        [sys.executable, "-m", "kconfgen", "--list-separator=semicolon", "--kconfig", str(idf / "Kconfig")]
        + ["--sdkconfig-rename", str(idf / "sdkconfig.rename"), "--config", str(output / "sdkconfig")]
        + ["--env-file", str(output / "env.json"), "--env", "IDF_MINIMAL_BUILD=n"]
        + [word for path in defaults for word in ("--defaults", str(path))]
        + ["--output", "header", str(output / "sdkconfig.h"), "--output", "config", str(output / "sdkconfig")],
    ):
        run = subprocess.run(
            command, capture_output=True, text=True, check=False, env={**os.environ, **environment}, cwd=output
        )
        if run.returncode != 0:
            raise RuntimeError(f"{Path(command[1]).name}: {run.stdout}{run.stderr}")
        said += run.stdout + run.stderr
    return said


def without_effect(root: Path, chip: str, kind: Kind, sdkconfig: str) -> list[str]:
    """Lines of our sdkconfig files that the configuration made of them does not have: an option that this ESP-IDF
    does not know, has renamed, or whose condition is not met."""
    has = set(sdkconfig.splitlines())
    lines = configuration_lines(root, chip, kind)
    return [line for line in lines if re.sub(r"^(CONFIG_\w+)=n$", r"# \1 is not set", line) not in has]


def _kconfig_environment(idf: Path, chip: str, output: Path) -> dict[str, str]:
    components = sorted(path for path in (idf / "components").iterdir() if path.is_dir())

    def files(*names: str) -> str:
        return ";".join(str(path / name) for path in components for name in names if (path / name).is_file())

    return {
        "COMPONENT_KCONFIGS": files("Kconfig"),
        "COMPONENT_KCONFIGS_PROJBUILD": files("Kconfig.projbuild"),
        "COMPONENT_SDKCONFIG_RENAMES": files("sdkconfig.rename", f"sdkconfig.rename.{chip}"),
        "COMPONENT_KCONFIGS_SOURCE_FILE": str(output / "kconfigs.in"),
        "COMPONENT_KCONFIGS_PROJBUILD_SOURCE_FILE": str(output / "kconfigs_projbuild.in"),
        "IDF_TARGET": chip,
        "IDF_TOOLCHAIN": "gcc",
        "IDF_VERSION": "v5.5.3",
        "IDF_INIT_VERSION": "v5.5.3",
        "IDF_ENV_FPGA": "",
        "IDF_PATH": str(idf),
    }
