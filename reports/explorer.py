"""The explorer: a slider per field of a grid, and the metrics of every policy beside each other.

It shows the estimates of ``questions.summary.means``, a design point at a time. A page holds it
once. It needs a browser's JavaScript and nothing else; without that, it shows the middle setting.

    explorer(load_results("results/explorer"))
"""

import json
import math
import re
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import pandas as pd
from IPython.display import HTML

from analysis import names, numbers
from analysis.figures import style
from analysis.questions import summary
from analysis.results.tables import Results
from dess import InputError
from reports.pages.template import template


class Slider(NamedTuple):
    """A field of the grid: its values in their order, and the place that is shown at first."""

    field: str
    values: Sequence[Any]

    @property
    def start(self) -> int:
        """The number of the value in the middle."""
        return len(self.values) // 2

    @property
    def name(self) -> str:
        """What the field is called, in full."""
        return names.parameter(self.field).name

    @property
    def option(self) -> str:
        """The name without the symbol of the model, for where an index cannot be written."""
        return re.sub(r" C_[SC]$", "", self.name)

    @property
    def unit(self) -> str:
        """The unit of its values; empty if they have none."""
        return names.parameter(self.field).unit

    @property
    def texts(self) -> list[str]:
        """The values in words."""
        return [names.value_text(value) for value in self.values]


class Grid:
    """The means of a study whose design points are all combinations of some values.

    Attributes:
        results: Of the study.
        sliders: The fields with two values or more.
    """

    def __init__(self, results: Results):
        """Find the fields of a grid.

        Raises:
            InputError: If the study is no full grid of two fields or more.
        """
        self.results = results
        self._points = [point.values for point in results.store.manifest.points]
        fields = dict.fromkeys(field for values in self._points for field in values)
        columns = {field: _distinct([v.get(field) for v in self._points]) for field in fields}
        self.sliders = [Slider(f, values) for f, values in columns.items() if len(values) > 1]
        settings = {self._position(point) for point in range(len(self._points))}
        combinations = math.prod(len(slider.values) for slider in self.sliders)
        if len(self.sliders) < 2 or not len(settings) == len(self._points) == combinations:
            study = results.manifest["study"]["name"]
            raise InputError(
                f"explorer: {study} is no full grid of two fields or more; allowed: a study with "
                'kind = "grid"'
            )

    @cached_property
    def means(self) -> pd.DataFrame:
        """The means of the paper's metrics: by design point, policy and metric.

        Design points are in the order of the sliders, of which the last one moves first.
        """
        table = summary.means(self.results)
        table = table[table["metric"].isin([*names.METRICS])]
        order = {point: self._position(point) for point in range(len(self._points))}
        return table.sort_values("point", key=lambda p: p.map(order), kind="stable")

    @property
    def start(self) -> int:
        """The design point in the middle of all sliders."""
        middle = tuple(slider.start for slider in self.sliders)
        return next(p for p in range(len(self._points)) if self._position(p) == middle)

    def at(self, point: int) -> pd.DataFrame:
        """The rows of ``means`` of a design point."""
        return self.means[self.means["point"] == point]

    def in_words(self, point: int) -> str:
        """The setting of a design point: ``UAVs 2, flying time 70 mission slots``."""
        position = self._position(point)
        parts = [
            f"{slider.name[0].lower()}{slider.name[1:]} {slider.texts[number]} {slider.unit}"
            for slider, number in zip(self.sliders, position, strict=True)
        ]
        return ", ".join(part.strip() for part in parts)

    def _position(self, point: int) -> tuple[int, ...]:
        """The place of every slider at a design point."""
        values = self._points[point]
        return tuple(s.values.index(values.get(s.field)) for s in self.sliders)


def explorer(results: Results) -> HTML:
    """Sliders, a choice of policies, the three metrics of each, and a curve along a slider.

    Args:
        results: Of a study whose design is a grid.

    Raises:
        InputError: If the design is no full grid.
    """
    grid = Grid(results)
    colours = style.policy_colours(results.policies)
    looks = {policy: colours[policy][0] for policy in results.policies}
    at_start = grid.at(grid.start).set_index(["metric", "policy"])
    texts = {
        (metric, policy): f"{numbers.estimate(row)}, n = {row['n']:,}"
        for (metric, policy), row in at_start.iterrows()
    }
    shown = {"sliders": grid.sliders, "policies": looks, "metrics": names.METRICS, "texts": texts}
    data = json.dumps(_data(grid), separators=(",", ":")).replace("<", "\\u003c")
    return HTML(template("explorer.html").render(data=data, **shown))


def _data(grid: Grid) -> dict[str, Any]:
    """What the script of the page reads: the sliders, and the estimates of every design point.

    An estimate is its mean and the ends of its interval in tenths of a percent, and its number of
    missions. They are in the order of ``Grid.means``.
    """
    columns = ["mean", "low", "high", "n"]
    estimates = [
        [*map(_tenths, ends), n] for *ends, n in grid.means[columns].itertuples(index=False)
    ]
    return {
        "sliders": [
            {
                "option": slider.option,
                "unit": slider.unit,
                "values": slider.texts,
                "settings": [f"{slider.field}={json.dumps(v)}" for v in slider.values],
            }
            for slider in grid.sliders
        ],
        "estimates": estimates,
    }


def _tenths(share: float) -> int:
    """A share in tenths of a percent, as ``numbers.percent`` rounds it."""
    return round(10 * float(f"{100 * share:.1f}"))


def _distinct(values: Sequence[Any]) -> list[Any]:
    """Values without duplicates, in order of appearance; lists are values, too."""
    return [value for number, value in enumerate(values) if value not in values[:number]]
