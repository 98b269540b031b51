"""A panel of sliders for Jupyter, in which a what-if question is set, simulated and answered.

what_if_panel("paper", ["ddqn", "greedy"], settings={"uavs": 5}, baseline={"uavs": 3})
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import ipywidgets as widgets
from nbconvert.filters import markdown2html

import policies as registry
from analysis import names
from analysis.execution.runner import ChunkError
from analysis.questions.what_if.question import SIDES
from analysis.sweeps.what_if import WhatIf, what_if
from dess import InputError, ScenarioSpace, load_scenario
from reports.pages import html

# The fields that have sliders by default.
FIELDS = (
    *("uavs", "pads", "flying_time", "charge_start", "charge_complete"),
    *("initial_data", "arrival_rate", "quota"),
)
STEPS = 100  # smallest number of steps of a slider for numbers that are not integers

Fields = Mapping[str, Any]


class WhatIfPanel(widgets.VBox):
    """A panel that asks a what-if question and shows the answer.

    Attributes:
        baseline: For each field its slider in the baseline; a slider for a range has two handles.
        variation: For each field its slider in the variation. As long as it has the same value as
            the slider in the baseline, it follows that slider.
        policies: For each policy its checkbox.
        missions: The number of missions of each policy, in the baseline and in the variation.
        more: A list of the fields without sliders; choosing a field adds its sliders.
        button: The button that starts the simulation.
        progress: The number of missions that are done.
        output: The answer, or the reason why there is none, as HTML.
    """

    def __init__(
        self,
        sides: tuple[ScenarioSpace, ScenarioSpace],
        fields: Sequence[str],
        chosen: Sequence[str],
        missions: int,
        ask: Callable[..., WhatIf],
    ):
        """Make the widgets.

        Args:
            sides: The scenario of the baseline and of the variation.
            fields: The fields that have sliders.
            chosen: The policies that are chosen at the beginning.
            missions: The number of missions at the beginning.
            ask: The function that simulates. It takes the values of the sliders of the baseline and
                of the variation, the chosen policies, the number of missions, and a function that
                counts finished missions.
        """
        self._sides, self._ask = sides, ask
        self.baseline: dict[str, widgets.Widget] = {}
        self.variation: dict[str, widgets.Widget] = {}
        self._table = _table()
        self.more = widgets.Dropdown(description="Add a field", style={"description_width": "auto"})
        for field in fields:
            self.add(field)
        self.more.observe(self._chosen, "value")
        teams = dict.fromkeys([*chosen, *registry.names()])
        self.policies = {team: _checkbox(team, team in chosen) for team in teams}
        self.missions = widgets.BoundedIntText(missions, min=2, max=100_000, description="Missions")
        self.button = widgets.Button(description="Simulate", button_style="primary", icon="play")
        self.button.on_click(lambda _: self.simulate())
        self.progress = widgets.IntProgress(layout={"visibility": "hidden"})
        self.output = widgets.HTML()
        run = widgets.HBox([self.missions, self.button, self.progress])
        chooser = widgets.HBox([*self.policies.values()], layout={"flex_flow": "row wrap"})
        super().__init__([self._table, self.more, chooser, run, self.output])

    def add(self, field: str) -> None:
        """Add the sliders of a field.

        Raises:
            InputError: If the field does not hold numbers.
        """
        before, after = (_slider(self._sides, side, field) for side in (0, 1))
        before.observe(_following(after), "value")
        self.baseline[field], self.variation[field] = before, after
        name = names.parameter(field)
        label = widgets.Label(f"{name.plain} [{name.unit}]".removesuffix(" []"))
        self._table.children += (label, before, after)
        others = [other for other in self._sides[0].numeric if other not in self.baseline]
        self.more.options = ["", *others]

    def _chosen(self, change: Any) -> None:
        if change.new:
            self.add(change.new)

    def simulate(self) -> None:
        """Simulate the question that the sliders describe, and show the answer."""
        teams = [team for team, box in self.policies.items() if box.value]
        self.button.disabled, self.output.value = True, ""
        self.progress.value, self.progress.max = 0, 2 * len(teams) * self.missions.value
        self.progress.layout.visibility = "visible"
        try:
            before, after = (
                {field: _plain(slider.value) for field, slider in side.items()}
                for side in (self.baseline, self.variation)
            )
            missions = self.missions.value
            asked = self._ask(before, after, teams, missions, self._count)
            self.output.value = _answer(asked)
        except (InputError, ChunkError) as error:
            self.output.value = f'<p role="alert">{escape(str(error))}</p>'
        finally:
            self.progress.layout.visibility = "hidden"
            self.button.disabled = False

    def _count(self, missions: int) -> None:
        self.progress.value += missions


def what_if_panel(
    scenario: str | Path = "paper",
    policies: Sequence[str] = ("ddqn", "greedy"),
    settings: Fields | None = None,
    baseline: Fields | None = None,
    folder: str | Path = "results",
    missions: int = 500,
    seed: int = 0,
    fields: Sequence[str] = FIELDS,
) -> WhatIfPanel:
    """A panel with sliders for fields of a scenario, in a baseline and in a variation of it.

    A field whose slider has the value of the scenario is not set. The missions are stored as by
    ``analysis.what_if``.

    Args:
        scenario: The name of a shipped scenario, or a TOML file.
        policies: The policies that are chosen at the beginning.
        settings: Fields that the variation sets; its sliders begin at these values. A field without
            a slider keeps its value.
        baseline: The same for the baseline, and for the variation where ``settings`` has no value.
        folder: Folder in which results are stored.
        missions: The number of missions at the beginning.
        seed: Seed of the missions.
        fields: The fields that have sliders at the beginning; each holds a number or a range.

    Raises:
        InputError: If the scenario, a field or a value is not allowed.
    """
    fixed, changed = dict(baseline or {}), dict(settings or {})
    scenario_itself = load_scenario(scenario)
    sides = (load_scenario(scenario, **fixed), load_scenario(scenario, **fixed | changed))

    def ask(before: Fields, after: Fields, teams: Sequence[str], number: int, count: Any) -> WhatIf:
        others = [{f: v for f, v in of.items() if f not in before} for of in (fixed, changed)]
        moved = {f: v for f, v in before.items() if v != _plain(_value(scenario_itself, f))}
        varied = {field: value for field, value in after.items() if value != before[field]}
        return what_if(
            {**others[1], **varied}, {**others[0], **moved}, scenario, teams, number, seed, folder,
            progress=count,
        )  # fmt: skip

    return WhatIfPanel(sides, fields, policies, missions, ask)


def _table() -> widgets.GridBox:
    """A table for sliders, with a row per field and columns for baseline and variation."""
    heads = [widgets.HTML(f"<b>{text}</b>") for text in ("", *map(str.capitalize, SIDES))]
    columns = "max-content repeat(2, minmax(12rem, 22rem))"
    return widgets.GridBox(heads, layout={"grid_template_columns": columns})


def _slider(sides: Sequence[ScenarioSpace], side: int, field: str) -> widgets.Widget:
    """A slider at the value of a field in one scenario; its range fits both scenarios."""
    least, most = sides[side].limits(field)
    ends = [end for space in sides for end in _ends(_value(space, field))]
    reach = 2 * max(map(abs, ends)) or 1
    low, high, value = max(least, -reach), min(most, reach), _value(sides[side], field)
    options = {"value": value, "min": low, "max": high, "continuous_update": False}
    is_range = isinstance(value, tuple)
    if all(isinstance(end, int) for end in ends):
        slider = (widgets.IntRangeSlider if is_range else widgets.IntSlider)(**options)
    else:
        digits = max(-math.floor(math.log10((high - low) / STEPS)), 0)
        steps = 10.0**digits  # the slider counts its steps from its lower end
        options |= {"min": math.floor(low * steps) / steps, "step": 1 / steps}
        options |= {"readout_format": f".{digits}f"}
        slider = (widgets.FloatRangeSlider if is_range else widgets.FloatSlider)(**options)
    slider.layout.width = "auto"
    return slider.add_class(f"dess-{SIDES[side]}-{field}")


def _checkbox(team: str, chosen: bool) -> widgets.Checkbox:
    return widgets.Checkbox(chosen, description=team, indent=False, layout={"width": "9rem"})


def _following(slider: widgets.Widget) -> Callable[[Any], None]:
    """A function that moves a slider along with another one while both have the same value."""

    def follow(change: Any) -> None:
        if slider.value == change.old:
            slider.value = change.new

    return follow


def _value(space: ScenarioSpace, field: str) -> Any:
    """The value of a field; for ``pads``, the number of pads also if it follows from the zone."""
    return space.charging_pads if field == "pads" else space.value(field)


def _ends(value: Any) -> Iterator[float]:
    yield from value if isinstance(value, tuple) else (value,)


def _plain(value: Any) -> Any:
    """The value of a slider in the form of a scenario: a number, or ``[low, high]``."""
    ends = [round(end, 10) for end in _ends(value)]
    return ends[0] if len({*ends}) == 1 else ends


def _answer(asked: WhatIf) -> str:
    caption = f"n = {asked.missions:,} pairs per policy, 95 % intervals."
    figure = html.figure(asked.plot(), "Paired differences of the metrics", caption)
    answer = markdown2html(html.composed(asked.answer()))
    return f'<div style="max-width: 44rem">{answer}{figure.data}</div>'
