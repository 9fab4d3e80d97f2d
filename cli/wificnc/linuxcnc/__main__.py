"""`python3 -m wificnc.linuxcnc`: the HAL component."""

import sys

from wificnc.linuxcnc.component import main

sys.exit(main())
