"""LinuxCNC on a WiFiCNC controller: docs/linuxcnc.md. The HAL component itself is C, in linuxcnc/.

source: that as one file. halcompile: LinuxCNC's builder. config: a configuration from a machine profile.
"""
