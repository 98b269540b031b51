"""The one exception that bad input raises."""


class InputError(ValueError):
    """Input that the user can mend: one line saying where, what, and what is allowed."""
