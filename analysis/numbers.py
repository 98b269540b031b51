"""How numbers are written on pages and in the terminal, such as shares in percent."""

import re
from collections.abc import Callable, Iterable, Sequence
from types import MappingProxyType
from typing import Literal

import pandas as pd

# What a spreadsheet takes as the beginning of a formula.
_FORMULA = re.compile(r"^[=+\-@\t\r]")
# How many digits numbers have, here and in the scripts of pages: decimals of a share in percent,
# significant digits of a quantity, the size from which it is whole, and that below which it is but
# a rounding error of 0.
DIGITS = MappingProxyType({"percent": 1, "quantity": 4, "whole": 1000, "zero": 1e-12})
_NAN = re.compile(r"\bnan\b")


def why_nan(cells: Iterable[object]) -> str:
    """Why a table has nan, in words; empty if no cell has."""
    has_nan = any(_NAN.search(str(cell)) for cell in cells)
    if has_nan:
        return "nan: the missions are too few, or too similar, to estimate it"
    return ""


def _format_hundredfold(share: float) -> str:
    return format_minus(f"{100 * share:.{DIGITS['percent']}f}")


def format_percent(value: float) -> str:
    """``0.9731`` as ``97.3 %``."""
    return f"{_format_hundredfold(value)} %"


def format_interval(mean: float, low: float, high: float) -> str:
    """A mean and its interval as ``97.3 % [96.1, 98.1]``."""
    ends = map(_format_hundredfold, (low, high))
    return f"{format_percent(mean)} [{', '.join(ends)}]"


def with_ends(write: Callable[[float], str], mean: float, low: float, high: float) -> str:
    """An estimate and its interval, each number as ``write`` has it: ``1 [0, 2]``."""
    return f"{write(mean)} [{write(low)}, {write(high)}]"


def format_estimate(row: pd.Series) -> str:
    """A row of estimates (``mean``, ``low``, ``high``) as ``97.3 % [96.1, 98.1]``."""
    return format_interval(row["mean"], row["low"], row["high"])


def format_difference(value: float, reference: float) -> str:
    """A value minus a reference value in percentage points, as ``+7.4`` or ``−2.1``."""
    points = round(100 * (value - reference), 1) or 0.0  # no −0.0
    if points:
        return format_minus(f"{points:+.1f}")
    return "0.0"


def format_points(value: float, low: float, high: float) -> str:
    """A difference and its interval in percentage points, as ``+7.4 [6.9, 7.9]``."""
    return with_ends(lambda points: format_difference(points, 0), value, low, high)


def format_decimals(value: float, low: float, high: float, digits: int = 3) -> str:
    """An estimate and its interval as ``1.0123 [0.9868, 1.0378]``, with ``digits`` decimals."""
    return with_ends(lambda number: format_minus(f"{number:.{digits}f}"), value, low, high)


def format_quantity(value: float) -> str:
    """A number with about four digits, as ``1,042`` or ``12.35``; 0 if it is but rounding of 0."""
    if abs(value) < DIGITS["zero"]:
        return "0"
    if abs(value) >= DIGITS["whole"]:
        text = f"{value:,.0f}"
    else:
        text = f"{value:.{DIGITS['quantity']}g}"
    return text.replace("-", "−")


def format_quantities(mean: float, low: float, high: float) -> str:
    """An estimate and its interval as ``1,042 [1,010, 1,074]``."""
    return with_ends(format_quantity, mean, low, high)


def format_estimates(
    rows: pd.DataFrame, name: str, write: Callable[[float, float, float], str] = format_interval
) -> pd.Series:
    """The column ``NAME`` of estimates with its ends ``NAME_low`` and ``NAME_high``, as text."""
    ends = rows[[name, f"{name}_low", f"{name}_high"]].to_numpy(float)
    return pd.Series([write(*row) for row in ends], rows.index, dtype=object)


def format_minus(number: str) -> str:
    """A number with a typographic minus sign (U+2212), and without a sign if it is zero."""
    is_zero = not float(number.replace(",", ""))
    if is_zero:
        return number.replace("-", "")
    return number.replace("-", "−")


def format_margin(share: float) -> str:
    """A difference between shares in words, as ``1 point`` or ``0.5 points``."""
    return f"{100 * share:g} point{'' if share == 0.01 else 's'}"


def format_level(share: float) -> str:
    """A confidence level, as ``95 %``."""
    return f"{100 * share:g} %"


def format_p_value(p: float) -> str:
    """A p-value, as ``0.094``, or ``< 0.001``."""
    return f"{p:.3f}" if p >= 0.001 else "< 0.001"


def format_money(amount: float, currency: str) -> str:
    """An amount as ``69,000 EUR``; with two decimals below 100."""
    if abs(amount) >= 100:
        text = f"{amount:,.0f}"
    else:
        text = f"{amount:.2f}"
    return f"{format_minus(text)} {currency}"


def format_amounts(mean: float, low: float, high: float, sign: Literal["", "+"] = "") -> str:
    """A cost and its interval as ``69,120 [68,400, 69,840]``; with two decimals below 100.

    A cost that is the same in every mission has no interval. With ``sign``, amounts that are more
    have a plus.
    """
    digits = 0 if abs(mean) >= 100 else 2

    def write(amount: float) -> str:
        return format_minus(f"{amount:{sign if amount else ''},.{digits}f}")

    if low == high:
        return write(mean)
    return with_ends(write, mean, low, high)


def format_seconds(time: float) -> str:
    """A time [s] with at most three digits, as ``2.35 µs`` or ``1.1 ms``."""
    units = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9))
    unit, size = next((pair for pair in units if time >= pair[1]), units[-1])
    return f"{float(f'{time / size:.3g}'):g} {unit}"


def format_duration(time: float) -> str:
    """A long time [s] in its largest unit, as ``50 seconds``, ``12 minutes`` or ``1,200 days``."""
    units = (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0), ("seconds", 1.0))
    unit, size = next((pair for pair in units if time >= 2 * pair[1]), units[-1])
    return f"{time / size:,.0f} {unit}"


def format_span(values: Iterable[float], form: str = "{:,}") -> str:
    """The smallest and the largest of some numbers, as ``20 to 1,200``, or ``300`` if equal."""
    ordered = sorted(values)
    return " to ".join(dict.fromkeys(map(form.format, (ordered[0], ordered[-1]))))


def format_count(number: int, what: str) -> str:
    """A number of things, as ``1 policy`` or ``3,000 policies``."""
    return f"{number:,} {inflect(what, number)}"


def inflect(what: str, number: float) -> str:
    """The name of a thing, or of several, as ``policy`` or ``policies``."""
    if number == 1:
        return what
    if what.endswith("y"):
        return f"{what.removesuffix('y')}ies"
    return f"{what}s"


def format_truth(value: object) -> str:
    """``yes`` or ``no``."""
    return "yes" if value else "no"


def format_signed(value: float, form: str = "+,.0f") -> str:
    """A number with its sign, as ``+1,042`` or ``−12``."""
    return format_minus(f"{value:{form}}")


def join_words(names: Sequence[str], last: str = "and") -> str:
    """A list of names as ``a, b and c``; another word may come before the last."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


def write_csv(frame: pd.DataFrame, form: str | None = None) -> str:
    """A table in CSV; a text that a spreadsheet would take as a formula begins with an apostrophe.

    A spreadsheet runs formulas when it opens a file, and they may read and send other cells.

    Args:
        frame: The table.
        form: The format of its numbers, such as ``%.6g``; by default all digits.
    """
    safe = frame.map(lambda cell: _FORMULA.sub(r"'\g<0>", cell) if isinstance(cell, str) else cell)
    return safe.to_csv(index=False, float_format=form and form.__mod__)


def estimates_as_text(
    table: pd.DataFrame,
    index: str | list[str],
    columns: str = "metric",
    write: Callable[[float, float, float], str] = format_interval,
) -> pd.DataFrame:
    """Turn a long table of estimates into a wide table of text.

    Rows and columns are in the order in which they appear in the long table.

    Args:
        table: One row per estimate, with ``mean``, ``low``, ``high`` and the columns named below.
        index: Columns whose values name a row of the result.
        columns: The column whose values name a column of the result.
        write: Writes a mean and the ends of its interval as text.
    """
    text = [write(*ends) for ends in table[["mean", "low", "high"]].to_numpy(float)]
    cells = table.assign(text=text).pivot(index=index, columns=columns, values="text")
    order = table.drop_duplicates(index).set_index(index).index
    return cells.loc[order, table[columns].unique()].rename_axis(columns=None)
