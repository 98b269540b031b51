"""Rendered pages: notebooks run in kernels, made into HTML files that can be verified."""
