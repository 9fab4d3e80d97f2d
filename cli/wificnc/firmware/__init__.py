"""Firmware of the boards after the build: how it gets onto a board, its storage, and releases.

page_header: the page in it. flash: writes it. nvs: images of the stored settings. release: all that people download.
"""
