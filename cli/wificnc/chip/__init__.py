"""Chips without a vendor's tools: their images, and the virtual PIC32MZ that runs them (tools/mzsim)."""
