"""`python -m wificnc`."""

from wificnc.app import main

main()
