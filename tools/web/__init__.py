"""Builds the page for browsers (web/): npm's packages, the core as WebAssembly, Vite."""
