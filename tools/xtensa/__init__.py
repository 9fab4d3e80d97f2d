"""The ESP32's firmware without Espressif's toolchain.

Every C file is compiled to Xtensa objects by Debian's clang, against the small headers of targets/esp32/test/idf_api
or, with IDF_PATH set, against the real ones of ESP-IDF; and what the objects say of the interrupts is checked.
"""
