"""The controller in real time: targets/pc/serve.h as a program of its own, started, watched and ended from here.

A program and not a library call, so that its pace never waits for Python, it runs under sanitizers and debuggers as it
is, and it ends when whoever started it does.
"""
