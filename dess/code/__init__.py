"""Compiling functions with numba, and hashing the source code that results depend on."""
