"""The core on this computer. Jobs in virtual time: options in, figures, traces and pictures out.

check: a preflight by such a run. serve: the same controller in real time.
"""
