"""Scenarios as WebAssembly: the coupled engine's own functions, run by a page without a server."""
