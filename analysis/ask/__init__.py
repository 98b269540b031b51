"""Questions asked in one line of Python: ``dess.analysis.sweep`` and ``dess.analysis.what_if``."""
