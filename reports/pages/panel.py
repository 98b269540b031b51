"""The panel of a page: its reader changes settings, and the page simulates missions of them.

    display(make_panel(baseline, variation, "paper", ["greedy"], seed=0))

The page carries the WebAssembly module and an image of the scenario (``dess.analysis.wasm``), so it
needs no network and no Python. Without JavaScript or WebAssembly, and on paper, there is no panel.
"""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import PurePath
from types import MappingProxyType
from typing import Any

from IPython.display import HTML, Markdown
from markupsafe import Markup

from dess import InputError
from dess.analysis.execution.effort import seconds_of
from dess.analysis.figures import style
from dess.analysis.metrics import NODES_BEHIND, PRODUCT, choose_units, metric_of
from dess.analysis.stats.requirement import Requirement
from dess.analysis.study.prices import Costs
from dess.analysis.wasm.entry import METRICS, POLICIES
from dess.analysis.wasm.image import explain_refusal, make_image
from dess.analysis.wasm.module import read_module
from dess.base.files.documents import Document
from dess.base.files.writing import toml_value
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.page import PANEL, hidden_element
from dess.reports.pages.panel_metrics import (
    Search,
    describe_metrics,
    describe_prices,
    describe_requirements,
    other_prices,
)
from dess.reports.pages.panel_missions import CHECKED, hash_missions
from dess.reports.pages.panel_settings import (
    COUNTS,
    OF_SHEET,
    OFFERED,
    describe_setting,
    settings_of,
    value_of,
)
from dess.reports.pages.templates import (
    PANEL_SCRIPT,
    SINGLE_SCRIPT,
    pack,
    page_script,
    render_part,
)
from dess.scenario.fields import is_number
from dess.scenario.scenario import SEA, ScenarioSpace, is_scenario_name
from dess.scenario.values import dotted

PAPER = "paper"  # the scenario of the example of the index
PORTION = 25  # the most missions of a call of the module
MISSIONS = 1000  # of a run, unless the reader asks for others
MOST_SECONDS = 120.0  # that these missions may take in Python
SIDES = {"a": "A: the baseline", "b": "B: the variation"}
_NO_NODES = Markup(
    '<p class="no-costs">The panel of this page has no requirements, since it does not know what '
    "is collected of each node.</p>\n"
)
_NO_NOTE = Markup("")
_EXAMPLE_SETTINGS = ("uavs", "pads", "arrival_rate")
_SIDE = 8  # of the grid, the most numbers of UAVs and of pads


class Panel(Document):
    """What a panel is made of, which its page keeps, so that the panel can be made again.

    Attributes:
        scenario: The scenario on the command line: its name, or the name of its file.
        given: The fields of this scenario that the page sets, and their values in A. Commands
            repeat them.
        baseline: The values of the scenario that A begins with.
        variation: Those that B begins with.
        policy: The policy of both.
        seed: The seed of the missions.
        module: The SHA-256 hash of the WebAssembly module.
        costs: The prices, if the missions have costs.
        requirements: The bounds on the means of metrics that the page is about.
        varied: By setting, the values that the study of the page has.
        search: What the grid has of the search of the page, if that is one.
        is_single: Whether it only shows single missions of the baseline.
    """

    scenario: str
    given: dict[str, Any]
    baseline: dict[str, Any]
    variation: dict[str, Any]
    policy: str
    seed: int
    module: str
    costs: Costs | None = None
    requirements: dict[str, float] = {}
    varied: dict[str, list[Any]] = {}
    search: Search | None = None
    is_single: bool = False

    @property
    def spaces(self) -> tuple[ScenarioSpace, ScenarioSpace]:
        """The scenarios of A and of B.

        Raises:
            InputError: If one is not valid.
        """
        return ScenarioSpace.of(**self.baseline), ScenarioSpace.of(**self.variation)

    def render(self) -> str:
        """The panel as HTML.

        Raises:
            InputError: If the module cannot simulate these missions.
        """
        baseline, variation = self.spaces
        if why := explain_refusal(baseline, [self.policy]):
            raise InputError("panel", why, "a heuristic in the slotted model")
        time = seconds_of([baseline], self.policy, (CHECKED, CHECKED))
        if time.high > MOST_SECONDS:
            problem = f"{CHECKED} missions would take {time}"
            raise InputError("panel", problem, f"{MOST_SECONDS:.0f} seconds at most")
        settings = dict(settings_of(baseline, variation, self.varied))
        image = make_image(baseline, [self.policy], self.seed, PORTION, settings, self.costs)
        starts = {
            side: [values.index(value_of(space, key)) for key, values in settings.items()]
            for side, space in zip(SIDES, (baseline, variation), strict=True)
        }
        fixed = [key for key in self.given if key not in settings]
        fleet = len(image.arrays["uavs"][0])
        metrics = [*describe_metrics(baseline, self.costs, self.search)]
        data = {
            "settings": [
                describe_setting(key, values, baseline, self._default_of(baseline, key))
                for key, values in settings.items()
            ],
            # What commands have to set beside these settings.
            "fixed": [f"{key}={toml_value(self.given[key])}" for key in fixed],
            "policies": [name for name in POLICIES if name != "random-unguarded"],
            "metrics": metrics,
            "prices": [*describe_prices(self.costs)],
            "priced": [*other_prices(self.costs)],
            "grid": self._grid(settings),
            "sea": _describe_sea(baseline, fleet),
            "product": METRICS.index(PRODUCT),
            "scenario": self.scenario,
            "isFile": not is_scenario_name(self.scenario),
            "seed": self.seed,
            "check": {
                "policy": self.policy,
                "positions": starts["a"],
                "hashes": hash_missions(baseline, self.policy, self.seed, fleet),
            },
        }
        return str(
            render_part(
                "another.html" if self.is_single else "panel.html",
                data=data,
                module=pack(read_module()),
                network=pack(image.network),
                image=pack(json.dumps(image.document()).encode()),
                sides=SIDES,
                script=page_script(SINGLE_SCRIPT if self.is_single else PANEL_SCRIPT),
                currency=self.costs.currency if self.costs else "",
                year=self.costs.annuity_in_words if self.costs and self.costs.years else "",
                start={side: {"policy": self.policy, "positions": starts[side]} for side in SIDES},
                missions=MISSIONS,
                differs=self._why_the_grid_differs(),
                required=[*describe_requirements(self.requirements, metrics)],
            ).data
        )

    def _why_the_grid_differs(self) -> str:
        """Whose answer the page has, and why that of the grid may be another one."""
        if self.search is None or not self.search.fleet:
            return ""
        answer = f"The answer of the page is {self.search.fleet} with {self.search.policy}"
        if self.search.policy == self.policy:
            return (
                f"{answer}. The grid has the same missions and the same rule, but intervals that "
                "hold however often you look, which are wider; where it leaves open what the page "
                "has decided, the page is the evidence."
            )
        return (
            f"{answer}, which this page cannot simulate. The grid is of {self.policy}, which may "
            "need another fleet. So its cheapest fleet may differ from that of the page, and then "
            "both are right, each of its own policy."
        )

    def _default_of(self, baseline: ScenarioSpace, key: str) -> Any:
        """The value of a setting that commands need not name: that of the scenario, if known."""
        if key in self.given:
            return None
        return value_of(baseline, key)

    def _grid(self, settings: Mapping[str, Sequence[Any]]) -> dict[str, Any] | None:
        """The positions of the fleets of the buyer's grid, and the rule of its search."""
        if not self.requirements or self.search is None or not {*COUNTS} <= {*settings}:
            return None
        positions = {}
        for key in COUNTS:
            values = self.varied.get(key) or [value_of(self.spaces[0], key)]
            numbers = [value for value in values if value in settings[key] and is_number(value)]
            if not numbers:
                return None
            numbers = [numbers[place * (len(numbers) - 1) // (_SIDE - 1)] for place in range(_SIDE)]
            positions[key] = sorted({settings[key].index(number) for number in numbers})
        return {**positions, "rule": self.search.rule.for_pages()}


def make_panel(
    baseline: ScenarioSpace,
    variation: ScenarioSpace,
    scenario: str,
    policies: Sequence[str],
    seed: int,
    *,
    costs: Costs | None = None,
    requirements: Sequence[Requirement] = (),
    varied: Mapping[str, Sequence[Any]] = MappingProxyType({}),
    given: Mapping[str, Any] = MappingProxyType({}),
    search: Search | None = None,
) -> HTML | Markdown:
    """The panel of a baseline and a variation; a sentence instead where it is not possible.

    Args:
        baseline: The scenario that A begins with.
        variation: The one that B begins with.
        scenario: The name of the scenario, or the path of its file. Commands name the file alone,
            since a page has no path of a machine.
        policies: The policies of the page; the first that the module knows is the one to begin
            with, otherwise ``greedy``.
        seed: The seed of the missions.
        costs: The prices, if the missions have costs.
        requirements: Those that the page is about.
        varied: By setting, the values that the study of the page has, which the panel has too.
        given: The fields of the scenario that the page sets, and their values in A.
        search: What the grid has of the search of the page, if that is one.
    """
    note = _NO_NOTE
    if any(requirement.column in NODES_BEHIND for requirement in requirements):
        note = _NO_NODES
        requirements = ()  # a fleet that keeps only the others would be called right
    more = {
        "costs": costs,
        "search": search,
        "requirements": {
            name: requirement.bound
            for requirement in requirements
            for name in METRICS
            if requirement.column in (name, metric_of(name).in_units.column)
        },
        "varied": {
            key: [value for value in values if is_number(value) or key in OF_SHEET]
            for key, values in varied.items()
            if key in OFFERED
        },
    }
    panel = _panel_of(baseline, variation, scenario, policies, seed, given)
    return _show_panel(panel.model_copy(update=more), note)


def make_another(
    space: ScenarioSpace,
    scenario: str,
    policies: Sequence[str],
    seed: int,
    given: Mapping[str, Any] = MappingProxyType({}),
) -> HTML | Markdown:
    """What shows any single mission of a scenario, or of settings that its reader chooses.

    Args:
        space: The scenario.
        scenario: Its name, as in ``make_panel``.
        policies: The policies of the page, as in ``make_panel``.
        seed: The seed of the missions.
        given: The fields of the scenario that the page sets, and their values.
    """
    panel = _panel_of(space, space, scenario, policies, seed, given)
    return _show_panel(panel.model_copy(update={"is_single": True}))


def _panel_of(
    baseline: ScenarioSpace,
    variation: ScenarioSpace,
    scenario: str,
    policies: Sequence[str],
    seed: int,
    given: Mapping[str, Any],
) -> Panel:
    """A panel of two scenarios without costs and requirements."""
    if variation.failures.uav_rate and not baseline.failures.uav_rate:
        # Without failures it does not matter how long a repair takes: then it does not differ.
        repair = {"failures.uav_repair": variation.failures.uav_repair}
        if repair["failures.uav_repair"] != baseline.failures.uav_repair:
            baseline = ScenarioSpace.of(baseline, **repair)
            given = {**dotted(dict(given)), **repair}
    name = scenario if is_scenario_name(scenario) else PurePath(scenario).name
    return Panel(
        scenario=name,
        given={field: value for field, value in dotted(dict(given)).items() if field != SEA},
        baseline=baseline.model_dump(mode="json"),
        variation=variation.model_dump(mode="json"),
        policy=next((name for name in policies if name in POLICIES), "greedy"),
        seed=seed,
        module=sha256(read_module()).hexdigest(),
    )


def _show_panel(panel: Panel, note: Markup = _NO_NOTE) -> HTML | Markdown:
    """A panel, with what it is made of; a sentence instead where it is not possible."""
    try:
        rendered = panel.render()
    except InputError as error:
        return write_markdown("This page cannot simulate by itself: {why}", why=str(error))
    return HTML(hidden_element(PANEL, panel.model_dump_json()) + note + Markup(rendered))


def _describe_sea(space: ScenarioSpace, fleet: int) -> dict[str, Any]:
    """What a player draws of the scenario."""
    colours = {"uavs": style.uav_colours(fleet), "nodes": style.node_colours(len(space.nodes))}
    return {
        "size": space.size,
        "zones": space.rectangles,
        "nodes": space.nodes,
        "names": space.names,
        "noFly": space.no_fly,
        "units": choose_units(space.units),
        "trail": style.TRAIL,
        "colours": colours,
    }


def describe_example() -> dict[str, Any]:
    """What the index of pages simulates: fleets and data of the paper's sea.

    It is a file of the package, so that an index is made without simulating:
    ``python tools/wasm/make_example.py`` writes it.
    """
    space, other = (ScenarioSpace.of(PAPER, uavs=uavs) for uavs in (3, 4))
    settings = {
        key: values for key, values in settings_of(space, other) if key in _EXAMPLE_SETTINGS
    }
    image = make_image(space, ["greedy"], 0, PORTION, settings)
    starts = {
        side: [values.index(value_of(version, key)) for key, values in settings.items()]
        for side, version in (("a", space), ("b", other))
    }
    return {
        "module": sha256(read_module()).hexdigest(),
        "data": {
            "policy": "greedy",
            "settings": [
                describe_setting(key, values, space, value_of(space, key))
                for key, values in settings.items()
            ],
            "metrics": [metric for metric in describe_metrics(space, None) if metric["isOffered"]],
            "start": starts,
        },
        "image": image.document(),
    }
