"""Preflight: what of a job this machine cannot do, or only slower than asked, found by running it in virtual time."""
