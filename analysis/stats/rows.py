"""Rows of missions: their groups, and what is refused of columns and shares."""

from collections.abc import Iterator, Sequence

import pandas as pd

from dess import InputError
from dess.base.errors import unknown_name


def group_rows(missions: pd.DataFrame, by: Sequence[str]) -> Iterator[tuple[tuple, pd.DataFrame]]:
    """Groups of rows by the values of columns, in order of first appearance; all without any."""
    yield from missions.groupby(list(by), sort=False, dropna=False) if by else [((), missions)]


def check_columns(missions: pd.DataFrame, needed: Sequence[str]) -> None:
    """Raise ``InputError`` if a needed column is missing."""
    for name in needed:
        if name not in missions:
            raise unknown_name(name, "no such column", name, missions.columns)


def check_share(name: str, share: float) -> None:
    """Raise ``InputError`` unless a share, such as a confidence level, is between 0 and 1."""
    if not (isinstance(share, int | float) and 0 < share < 1):
        raise InputError(name, repr(share), "between 0 and 1")
