"""List the texts of the page that other languages lack: `python -m web.untranslated`, which is `make untranslated`."""

from __future__ import annotations

import sys

from wificnc import ui
from wificnc.errors import UserError

from web.build import ROOT, install_packages, require_tools, run_npm


def main() -> int:
    """Exit code; texts that are missing are no error."""
    try:
        require_tools()
        install_packages(ROOT)
        print(run_npm(ROOT, "run", "--silent", "untranslated"), end="")
    except UserError as error:
        ui.error(error)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
