"""Sizes of ESP32 firmware in the workflow: measured, against the budgets, and against the last build of main."""
