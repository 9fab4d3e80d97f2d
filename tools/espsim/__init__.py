"""A virtual ESP32 or ESP32-S3: an emulator in C (espsim.h), and Python around it."""
