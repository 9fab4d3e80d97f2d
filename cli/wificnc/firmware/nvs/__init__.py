"""Images of the ESP32's non-volatile storage: made from machine profiles, read back, compared."""
