"""What people download: images, packages, the page's firmware, sums, and what is in them. docs/releasing.md.

plan.py says what a release of these boards will be; run.py makes it. The same commit gives the same bytes.
"""
