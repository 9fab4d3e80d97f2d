"""WiFiCNC: boards, builds, flashing, streaming and simulation from one command line."""

__version__ = "0.1.0"
