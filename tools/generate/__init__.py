"""Everything in the repository that is written from tables: `make generate`, or `python -m generate` in tools/."""
