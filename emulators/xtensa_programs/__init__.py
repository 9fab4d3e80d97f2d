"""Programs without an operating system for the virtual ESP32: our core and its step engine, LLVM's code. Not in the
package: benches and tests build them."""
