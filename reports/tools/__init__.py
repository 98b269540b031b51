"""Tools that make the shipped learning curves and model cards; run them with ``python -m``."""
