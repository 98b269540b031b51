"""Years with weather of a setting: how old its data are, and what hours and windows it has.

year_facts(results, "greedy", [3])  # of a study of years
year_table(results, "greedy", 3)
draw_calendar(results, "greedy", 3)
"""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.facts import Fact, known_facts
from dess.analysis.figures import Drawing
from dess.analysis.metrics import AGE, NODE_AGES, column_in_sheet_unit, metric_of, size_of
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.sheet import node_titles
from dess.analysis.tables import Table
from dess.analysis.weather import NIGHT, OPEN, hours_by_month, reason_in_words
from dess.model.campaign import years_of
from dess.model.record import AGES_OF_MONTHS
from dess.scenario.weather import DAYLIGHT
from dess.scenario.weather.hours import Year, hours_of, years

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure

FEW = 3  # fewer years tell nothing of others
_NAMED = 5  # of more years, only the first and the last are named
_DIGITS = 2  # of the ages in a headline
_AGE_OF_MONTH = "age_h"  # the mean over the years in the table of a calendar
_NODES = f"{NODE_AGES}_{metric_of(AGE).sheet_unit}"  # the column with the mean ages of the nodes
_YOUNGEST, _OLDEST = "age_h_least", "age_h_most"  # of one of the years


@compute_once
def years_of_setting(results: Results, policy: str, point: int) -> pd.DataFrame:
    """The years of a setting, the earliest first.

    Args:
        results: A study of years.
        policy: The policy.
        point: The design point.

    Returns:
        A row per year: ``year``, ``replication``, ``open`` (the share of the operating hours in
        which UAVs could fly), ``windows``, ``longest_gap`` [h], the mean age ``age_h`` [h], the
        share ``late`` of the data, ``lost`` UAVs, the mean age of each node [h] (the column of
        ``NODE_AGES`` in hours), and the mean age of each month [h], ``AGES_OF_MONTHS``.
    """
    rows = results.missions
    rows = rows[(rows["policy"] == policy) & (rows["point"] == point)]
    uavs = results.uavs
    uavs = uavs[(uavs["policy"] == policy) & (uavs["point"] == point)]
    lost = uavs.groupby("replication")["down"].sum()
    names = ["open", "windows", "longest_gap", _age_column(results), "late", _NODES]
    table = rows[["replication", *names]].assign(lost=rows["replication"].map(lost))
    of_replications = years_of(results.scenario(point), results.store.manifest.seed)
    table.insert(0, "year", [of_replications[r].year for r in table["replication"]])
    units = results.scenario(point).units
    assert units
    of_months = rows[[*AGES_OF_MONTHS]] * size_of("h", units)
    return table.join(of_months).sort_values("year", ignore_index=True)


def setting_with_oldest_data(results: Results, policy: str, points: Sequence[int]) -> int:
    """The design point of a fleet under the condition with which its data are the oldest."""
    age = _age_column(results)
    means = [years_of_setting(results, policy, point)[age].mean() for point in points]
    return points[int(np.argmax(means))]


def age_sentence(results: Results, policy: str, points: Sequence[int]) -> str:
    """How old data are on average, and in the worst year.

    Args:
        results: A study of years.
        policy: The policy.
        points: The design points of a fleet, one for each condition. The one counts with which its
            data are the oldest.
    """
    point = setting_with_oldest_data(results, policy, points)
    ages = years_of_setting(results, policy, point)[_age_column(results)]
    write = metric_of(_age_column(results)).write
    mean, worst = (write(float(f"{age:.{_DIGITS}g}")) for age in (ages.mean(), ages.max()))
    if len(ages) == 1:
        return f"Data are {mean} old on average in a single year."
    return f"Data are {mean} old on average, {worst} in the worst of {len(ages)} years."


def year_facts(results: Results, policy: str, points: Sequence[int]) -> list[Fact]:
    """What years tell of a fleet beside what is required of it.

    Args:
        results: A study of years.
        policy: The policy.
        points: As for ``age_sentence``.
    """
    point = setting_with_oldest_data(results, policy, points)
    space = results.scenario(point)
    table = years_of_setting(results, policy, point)
    age = metric_of(_age_column(results))
    worst = table.loc[table[age.column].idxmax()]
    gap = table["longest_gap"]
    late = f"{numbers.format_percent(table['late'].mean())} on land more than {space.weather.due} "
    late += "after they were made"
    unknown = ""
    if len(table) < FEW:
        unknown = f"nothing is known of them by {numbers.format_count(len(table), 'year')}"
    return known_facts(
        [
            Fact("years", _years_in_words(results, point, table["year"])),
            Fact("other years", unknown),
            Fact("worst year", f"{worst['year']}, {age.within} {age.write(worst[age.column])}"),
            Fact("late data", late),
            Fact("oldest node", _oldest_node(results, point, table)),
            Fact(
                "windows",
                f"{table['windows'].mean():,.0f} a year; the longest gap of a year is "
                f"{gap.mean():.0f} h on average, {gap.max():.0f} h at most",
            ),
            Fact("lost UAVs", f"{numbers.format_quantity(table['lost'].mean())} a year"),
            Fact(
                "forecast",
                "policy and return guard know the weather of each window, at most "
                f"{space.weather.longest} ahead",
            ),
        ]
    )


def year_table(results: Results, policy: str, point: int) -> Table:
    """The years of a setting: their windows and gaps, and how old the data are.

    Args:
        results: A study of years.
        policy: The policy.
        point: The design point.
    """
    table = years_of_setting(results, policy, point)
    age = metric_of(_age_column(results))
    means = table.drop(columns=_NODES).mean()
    shown = pd.concat([table, means.to_frame().T], ignore_index=True)
    cells = {
        "Year": [*table["year"].astype(str), "mean"],
        "Open hours": shown["open"].map(numbers.format_percent),
        "Windows": shown["windows"].map("{:,.0f}".format),
        "Longest gap [h]": shown["longest_gap"].map("{:.0f}".format),
        age.name: shown[age.column].map(age.write),
        "Late data": shown["late"].map(numbers.format_percent),
        "Lost UAVs": shown["lost"].map(numbers.format_quantity),
    }
    due = results.scenario(point).weather.due
    caption = (
        "The years of the answer. Open hours are a share of those in which UAVs operate; a gap is "
        f"a time without a window; late data are on land more than {due} after they were made"
    )
    return Table(pd.DataFrame(cells), caption, table.drop(columns=_NODES))


def calendar_of(results: Results, policy: str, point: int) -> pd.DataFrame:
    """The months of the years of a setting.

    Args:
        results: A study of years.
        policy: The policy.
        point: The design point.

    Returns:
        The rows of ``hours_by_month`` of its years, with the mean age of the data in each month
        ``age_h``, and the least and the most of one of the years.
    """
    table = years_of_setting(results, policy, point)
    ages = table[[*AGES_OF_MONTHS]].to_numpy(float)
    months = hours_by_month(results.scenario(point), _years_of_replications(results, point, table))
    ends = {_AGE_OF_MONTH: ages.mean(axis=0), _YOUNGEST: ages.min(axis=0)}
    return months.assign(**ends, **{_OLDEST: ages.max(axis=0)})


def draw_calendar(results: Results, policy: str, point: int) -> Drawing:
    """The hours of a day in which UAVs can fly, month by month, and how old the data are.

    Args:
        results: A study of years.
        policy: The policy.
        point: The design point.
    """
    calendar = calendar_of(results, policy, point)
    count = len(years_of_setting(results, policy, point))
    oldest, youngest = (f(calendar[_AGE_OF_MONTH]) for f in (pd.Series.idxmax, pd.Series.idxmin))
    write = metric_of(_age_column(results)).write
    ends = [
        f"{write(float(f'{calendar.loc[month, _AGE_OF_MONTH]:.2g}'))} old in {month}"
        for month in (youngest, oldest)
    ]
    caption = f"Data are {ends[0]}, and {ends[1]}. Means over {numbers.format_count(count, 'year')}"
    if count > 1:
        caption += "; the band reaches from the least to the most of one year"
    alt = "Hours of a day by what closes them, and age of the data, by month"
    reasons = calendar.columns.drop([OPEN, _AGE_OF_MONTH, _YOUNGEST, _OLDEST])
    names = {OPEN: OPEN} | {name: reason_in_words(name) for name in reasons}
    if results.scenario(point).weather.operating == DAYLIGHT:
        names[NIGHT] = NIGHT
    data = calendar.reset_index(names="month")
    return Drawing(plot_calendar(calendar, names), alt, f"{caption}.", data)


def plot_calendar(calendar: pd.DataFrame, names: Mapping[str, str]) -> "Figure":
    """The age of the data by month, and below it the hours of a day by what closes them.

    Args:
        calendar: Rows of ``calendar_of``.
        names: What the columns of hours are called.
    """
    from dess.analysis.figures import style

    reasons = [name for name in names if calendar[name].any()]
    limits = [name for name in reasons if name not in (OPEN, *style.CLOSED_HOURS)]
    colours = {OPEN: style.OPEN_HOURS, **style.CLOSED_HOURS}
    colours |= dict(zip(limits, cycle(style.LIMITS)))  # noqa: B905 - the longer one is endless
    reasons.sort(key=lambda name: name == NIGHT)  # on top
    places = np.arange(len(calendar))
    ratios = {"height_ratios": [1.0, 1.3]}
    with style.new_panels(4.1, 2, "y", sharex=True, gridspec_kw=ratios) as (figure, (top, below)):
        ends = (calendar[_YOUNGEST], calendar[_OLDEST])
        top.fill_between(places, *ends, **style.band(style.INK))
        top.plot(places, calendar[_AGE_OF_MONTH], color=style.INK, marker="o", markersize=4)
        top.set(ylabel="age [h]", ylim=(0, None))
        bottom = np.zeros(len(calendar))
        for name in reasons:
            look = {"color": colours[name], "label": names[name]}
            below.bar(places, calendar[name], 0.82, bottom, **look)
            bottom += calendar[name]
        below.set(ylabel="hours a day", ylim=(0, 24), yticks=[0, 6, 12, 18, 24])
        below.set_xticks(places, [str(month) for month in calendar.index])
    return figure


def _years_in_words(results: Results, point: int, simulated: pd.Series) -> str:
    """Which years of the series were simulated."""
    space = results.scenario(point)
    whole = years(hours_of(space))
    named = numbers.join_words([str(year) for year in simulated])
    if len(simulated) > _NAMED:
        named = f"{len(simulated)} from {simulated.min()} to {simulated.max()}"
    if len(simulated) < len(whole):
        return f"{named}, drawn from the {len(whole)} of {space.weather.path.name}"
    return f"{named}, all of {space.weather.path.name}"


def _years_of_replications(results: Results, point: int, table: pd.DataFrame) -> list[Year]:
    ordered = years_of(results.scenario(point), results.store.manifest.seed)
    return [ordered[replication] for replication in table["replication"]]


def _oldest_node(results: Results, point: int, table: pd.DataFrame) -> str:
    """The node with the oldest data on average, and how old they are."""
    ages = np.mean([*table[_NODES]], axis=0)
    oldest = int(np.argmax(ages))
    (title,) = node_titles(results.scenario(point), [oldest])
    return f"{title}, {metric_of(AGE).within} {metric_of(_age_column(results)).write(ages[oldest])}"


def _age_column(results: Results) -> str:
    return column_in_sheet_unit(AGE, results.missions)
