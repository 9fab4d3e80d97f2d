"""Simulated jobs: options in, figures, traces and pictures out."""
