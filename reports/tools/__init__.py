"""Tools that make data which is shipped with the packages; run with ``python -m``."""
