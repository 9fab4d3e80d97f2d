"""LinuxCNC on a WiFiCNC controller: docs/linuxcnc.md.

slices: joint positions over time -> timed segments; pure. component: the HAL component around it,
`loadusr -Wn wificnc python3 -m wificnc.linuxcnc --address ADDRESS`.
"""
