"""How people get the command: the one home of the install lines. docs/start/README.md and README.md have them, all
other pages link to the first one (tests/repo/test_install.py)."""

from __future__ import annotations

from pathlib import Path

from generate.files import Texts, with_region

ON_INDEX = False  # True in the change that follows the first upload to PyPI, with `make generate`

PAGE = "docs/start/README.md"
README = "README.md"
DOWNLOAD = "Download `wificnc-….whl` for your system from the project's releases page into your Downloads folder."

# system -> commands, of a release's file and from the package index
_OF_FILE = {
    "Windows": "py -m pip install (Get-Item $HOME\\Downloads\\wificnc-*.whl).FullName",
    "macOS": "pip install ~/Downloads/wificnc-*.whl",
    "Linux": "pip install ~/Downloads/wificnc-*.whl",
}
_OF_INDEX = {
    "Windows": "py -m pip install wificnc",
    "macOS": "pip install wificnc",
    "Linux": "pip install wificnc",
}


def install_lines(on_index: bool = ON_INDEX) -> dict[str, str]:
    """System -> what is typed there."""
    return _OF_INDEX if on_index else _OF_FILE


def readme_text(on_index: bool = ON_INDEX) -> str:
    """The shortest way, for README.md."""
    lines = install_lines(on_index)
    return (
        f"{download_text(on_index)} It needs Python 3.10 or newer.\n\n"
        f"```\n{lines['Linux']:<61} # in a virtual environment; Windows: {lines['Windows']}\n"
        f"{'wificnc doctor':<61} # what is missing on this computer, and how to install it\n```\n\n"
        f"[Each system, step by step]({PAGE}#install-wificnc).\n\n"
    )


def texts(root: Path) -> Texts:
    """Path in the repository -> text. Raises ValueError when README.md does not have its region."""
    return {README: with_region((root / README).read_text(encoding="utf-8"), "install", readme_text())}


def download_text(on_index: bool = ON_INDEX) -> str:
    """What comes before these lines."""
    return "The package comes from PyPI." if on_index else DOWNLOAD
