"""The explorer: a slider for each field of a grid, and the metrics of every policy.

It shows the estimates of ``answers.summary.means_of_points`` for one design point at a time. A page
can contain one explorer. It needs only a browser with JavaScript; without JavaScript it shows the
setting at which the sliders start.

    make_explorer(load_results("results/explorer"))
"""

import json
import math
from functools import cached_property

import pandas as pd
from IPython.display import HTML

from dess import InputError
from dess.analysis import metrics, names, numbers
from dess.analysis.answers import summary
from dess.analysis.answers.settings.home import with_way_home
from dess.analysis.answers.settings.points import points_in_words, values_of_points, varied_values
from dess.analysis.figures import style
from dess.analysis.results.tables import Results
from dess.reports.pages.templates import render_part


class Grid:
    """The means of a study whose design points are all combinations of some values.

    Attributes:
        results: The results of the study.
        values: The fields with two values or more, and their values in their order.
    """

    def __init__(self, results: Results):
        """Find the fields of a grid.

        Raises:
            InputError: If the study is not a full grid of two fields or more.
        """
        self.results = results
        self.values = varied_values(results)
        table = values_of_points(results)
        places = {
            field: table[field].map(swept_values.index)
            for field, swept_values in self.values.items()
        }
        self._places = pd.DataFrame(places).sort_values([*places])
        settings = math.prod(map(len, self.values.values()))
        if len(places) < 2 or not len(table) == len(table.drop_duplicates()) == settings:
            study = results.study.name
            raise InputError(
                "explorer",
                f"{study} is not a full grid of two fields or more",
                'a study with kind = "grid"',
            )

    @property
    def start(self) -> int:
        """The design point at which the sliders start: in the middle of three values or more."""
        middle_places = [len(values) // 2 for values in self.values.values()]
        return int(self._places.index[(self._places == middle_places).all(axis=1)][0])

    @cached_property
    def metrics(self) -> dict[str, str]:
        """The metrics that are shown, with their names: the paper's, and home beside success."""
        shown = with_way_home(self.results, metrics.METRICS)
        return {metric: metrics.metric_of(metric).name for metric in shown}

    @cached_property
    def means(self) -> pd.DataFrame:
        """The means of the metrics, by design point, policy and metric.

        Design points are in the order of the sliders; the value of the last slider varies fastest.
        """
        table = summary.means_of_points(self.results)
        table = table[table["metric"].isin([*self.metrics])]
        orders = {
            "point": {point: number for number, point in enumerate(self._places.index)},
            "policy": {policy: number for number, policy in enumerate(self.results.policies)},
            "metric": {metric: number for number, metric in enumerate(self.metrics)},
        }
        return table.sort_values([*orders], key=lambda column: column.map(orders[column.name]))

    def at_start(self) -> pd.DataFrame:
        """The rows of ``means`` of the design point ``start``."""
        return self.means[self.means["point"] == self.start]

    def describe_start(self) -> str:
        """The policies at the design point ``start``, which it names, the best first."""
        rows = self.at_start()
        best = rows[rows["metric"] == metrics.PRODUCT].sort_values("mean", ascending=False)
        parts = [f"{row.policy} {numbers.format_percent(row.mean)}" for row in best.itertuples()]
        setting = points_in_words(self.results)[self.start]
        counted = numbers.format_span(best["n"])
        return (
            f"With {setting}, the product is {numbers.join_words(parts)} (n = {counted} missions)."
        )

    def means_table(self) -> pd.DataFrame:
        """The means of all settings: the fields, then the columns of ``dess.analysis.summary``."""
        return self.means.join(values_of_points(self.results), on="point")[
            [*self._places, "policy", "metric", "mean", "low", "high", "n"]
        ]

    def format_settings(self, field: str) -> list[str]:
        """The values of a field in the form of ``--set``, such as ``initial_data=[5, 7.5]``."""
        first = self._places.reset_index().groupby(field)["index"].first()
        design = self.results.store.manifest.points
        return [f"{field}={json.dumps(design[point].values[field])}" for point in first]


def make_explorer(results: Results) -> HTML:
    """Sliders, a choice of policies, the metrics of each, and a curve along a slider.

    Args:
        results: The results of a study whose design is a grid.

    Raises:
        InputError: If the design is not a full grid.
    """
    grid = Grid(results)
    colours = style.policy_colours(results.policies)
    styles = {policy: colours[policy][0] for policy in results.policies}
    texts = {
        (
            row.metric,
            row.policy,
        ): f"{numbers.format_interval(row.mean, row.low, row.high)}, n = {row.n:,}"
        for row in grid.at_start().itertuples()
    }
    columns = ["mean", "low", "high", "n"]
    fields = [names.field_named(field) for field in grid.values]
    data = {
        "settings": [
            {
                "key": field.key,
                "name": field.name,
                "plain": field.plain,
                "unit": field.unit,
                "texts": [names.value_text(value) for value in grid.values[field.key]],
                "options": grid.format_settings(field.key),
            }
            for field in fields
        ],
        # Of each estimate in the order of the means: the mean and the ends of its interval, in
        # tenths of a percent, and the number of missions.
        "estimates": [
            [*map(_round_to_tenths, ends), n]
            for *ends, n in grid.means[columns].itertuples(index=False)
        ],
    }
    middle = [len(values) // 2 for values in grid.values.values()]
    shown = {"policies": styles, "metrics": grid.metrics, "texts": texts}
    start = {"explorer": {"positions": middle}}
    return render_part("explorer.html", data=data, start=start, **shown)


def _round_to_tenths(share: float) -> int:
    """A share in tenths of a percent, rounded like ``numbers.format_percent``."""
    return round(10 * float(f"{100 * share:.1f}"))
