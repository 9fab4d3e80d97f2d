"""PlatformIO names the runner as pytest names its tests."""

collect_ignore = ["test_custom_runner.py"]
