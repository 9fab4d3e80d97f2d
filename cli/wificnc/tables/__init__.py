"""The tables that C and Python share: protocol/*.toml, read once, checked, and turned into text by `generate`."""

from wificnc.tables.settings import AXES, Setting, SettingsTable, load_settings

__all__ = ["AXES", "Setting", "SettingsTable", "load_settings"]
