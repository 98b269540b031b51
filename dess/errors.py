"""The exception for all bad input."""


class InputError(ValueError):
    """Bad input: one line that says where, what, and what is allowed."""
