"""Questions asked in one line of Python: ``analysis.sweep`` and ``analysis.what_if``."""
