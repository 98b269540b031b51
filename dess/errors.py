"""The exception that invalid input raises."""


class InputError(ValueError):
    """Invalid input; one line that names the place, the problem and the allowed values."""
