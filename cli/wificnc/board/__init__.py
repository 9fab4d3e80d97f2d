"""Boards: what a board wires, checked against what its chip's pins can do, and what follows from it.

Pure functions: text and paths in, objects and text out. Nothing here talks to a terminal.
"""
