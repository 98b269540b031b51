"""Questions asked in one line and kept: ``analysis.sweep`` and ``analysis.what_if``."""
