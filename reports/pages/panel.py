"""The panel of a page: its reader changes settings, and the page simulates missions of them.

    display(make_panel(baseline, variation, "paper", ["greedy"], seed=0))

The page carries the WebAssembly module and an image of the scenario (``dess.analysis.wasm``), so it
needs no network and no Python. Without JavaScript or WebAssembly, and on paper, there is no panel.
"""

import gzip
import json
import re
import zlib
from base64 import b64decode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import PurePath
from types import MappingProxyType
from typing import Any

from IPython.display import HTML, Markdown
from markupsafe import Markup

from dess import InputError, simulate_batch
from dess.analysis.execution.effort import seconds_of
from dess.analysis.figures import style
from dess.analysis.metrics import (
    AGE,
    NODES_BEHIND,
    PRODUCT,
    RATIO,
    SUCCESS,
    choose_units,
    metric_of,
    size_of,
)
from dess.analysis.names import RANGES, ZONE_PADS, field_named, value_text
from dess.analysis.numbers import format_quantity
from dess.analysis.stats.requirement import Requirement
from dess.analysis.study.cheapest import Cheapest, horizon_of
from dess.analysis.study.prices import Costs
from dess.analysis.wasm.entry import METRICS, PRICES
from dess.analysis.wasm.image import explain_refusal, make_image
from dess.analysis.wasm.module import read_module
from dess.base.files.documents import Document
from dess.base.files.writing import toml_value
from dess.model.record import Records, empty_records, measures_of
from dess.policies.heuristics import KINDS
from dess.policies.registry import load
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.page import PANEL, hidden_element
from dess.reports.pages.templates import (
    PANEL_SCRIPT,
    SINGLE_SCRIPT,
    pack,
    page_script,
    render_part,
)
from dess.scenario.data_sheet import Units
from dess.scenario.fields import dotted, is_number
from dess.scenario.quantities import measured, printed, times
from dess.scenario.scenario import SEA, ScenarioSpace, is_scenario_name

PAPER = "paper"  # the scenario of the example of the index
PORTION = 25  # the most missions of a call of the module
MISSIONS = 1000  # of a run, unless the reader asks for others
CHECKED = 100  # of the baseline, which are compared with those of Python
MOST_SECONDS = 120.0  # that these missions may take in Python
SIDES = {"a": "A: the baseline", "b": "B: the variation"}
# What is paid for, in words.
_PRICED = {
    "uav": "A UAV",
    "pad": "A charging pad",
    "charge": "A full charge",
    "hour": "An hour of a mission",
    "lost_uav": "A lost UAV",
    "missions": "Missions planned for the fleet",
    "days": "Days of a year with a mission",
    "pack": "A battery pack",
    "pack_cycles": "Full charges after which a pack is worn",
}
_WHOLE = ("missions", "days")  # what is counted, 1 at least
_MOST = {"days": 365}
_MOST_AMOUNT = 10**12
_NO_NODES = Markup(
    '<p class="no-costs">The panel of this page has no requirements, since it does not know what '
    "is collected of each node.</p>\n"
)
_NO_NOTE = Markup("")
_HASH = r'"([0-9a-f]{64})"'
_PACKED = re.compile('(?<=type="text/plain">)([A-Za-z0-9+/=]+)(?=</script>)')
_ENCODED = re.compile("[A-Za-z0-9+/=]*")

# What a reader may change wherever the scenario lets him, and by which values.
_COUNTS = {"uavs": 8, "pads": 16}  # every number up to this one, or to that of the page
_MOST_POSITIONS = 64  # of a slider
_SCALED = {
    "arrival_rate": (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0),
    "max_slots": (0.5, 0.75, 1.0, 1.5, 2.0),
}
_LEVELS = {
    "charge_start": (10, 20, 30, 40, 50),
    "charge_complete": (60, 70, 80, 90, 100),
    "failures.uav_rate": (0.0, 0.0005, 0.001, 0.002, 0.005),
}
_MTBF = "data_sheet.mtbf"
# What a data sheet says, in which units, times these factors.
_OF_SHEET = {
    "data_sheet.data_rate": ("bit/s", (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)),
    "data_sheet.wind": ("m/s from deg", (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)),
    _MTBF: ("s", (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)),
}
# How often UAVs fail, which is told as the mean time between failures.
_FAILURES = ("failures.uav_rate", _MTBF)
_EXAMPLE_SETTINGS = ("uavs", "pads", "arrival_rate")
_SIDE = 8  # of the grid, the most numbers of UAVs and of pads
# What a search can require, by the names of the command line.
_REQUIRED = {SUCCESS: "success", RATIO: "ratio", PRODUCT: "product", AGE: "age"}
_OFFERED = (*_COUNTS, ZONE_PADS, *_SCALED, *_OF_SHEET, *_LEVELS)


class Search(Document):
    """The search of a page for the cheapest fleet, of which the grid of its panel is a part.

    Attributes:
        policy: The policy of its answer.
        fleet: The fleet of its answer, in words; empty if there is none.
        tolerance: How far from a requirement either verdict is right, as a share.
        indifference: The least saving that matters, in the currency.
    """

    policy: str
    fleet: str
    tolerance: float
    indifference: float


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
        settings = dict(_settings_of(baseline, variation, self.varied))
        image = make_image(baseline, [self.policy], self.seed, PORTION, settings, self.costs)
        starts = {
            side: [values.index(_value_of(space, key)) for key, values in settings.items()]
            for side, space in zip(SIDES, (baseline, variation), strict=True)
        }
        fixed = [key for key in self.given if key not in settings]
        fleet = len(image.arrays["uavs"][0])
        metrics = [*_describe_metrics(baseline, self.costs, self.search)]
        data = {
            "settings": [
                _describe_setting(key, values, baseline, self._default_of(baseline, key))
                for key, values in settings.items()
            ],
            # What commands have to set beside these settings.
            "fixed": [f"{key}={toml_value(self.given[key])}" for key in fixed],
            "policies": [name for name in KINDS if name != "random-unguarded"],
            "metrics": metrics,
            "prices": [*_describe_prices(self.costs)],
            "priced": [*_other_prices(self.costs)],
            "grid": self._grid(settings),
            "indifference": self.search.indifference if self.search else 0.0,
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
                image=pack(json.dumps(image.document()).encode()),
                sides=SIDES,
                script=page_script(SINGLE_SCRIPT if self.is_single else PANEL_SCRIPT),
                currency=self.costs.currency if self.costs else "",
                year=self.costs.annuity_in_words if self.costs and self.costs.years else "",
                start={side: {"policy": self.policy, "positions": starts[side]} for side in SIDES},
                missions=MISSIONS,
                differs=self._why_the_grid_differs(),
                required=[*_describe_requirements(self.requirements, metrics)],
            ).data
        )

    def _why_the_grid_differs(self) -> str:
        """Whose answer the page has, and why that of the grid may be another one."""
        if self.search is None or not self.search.fleet:
            return ""
        answer = f"The answer of the page is {self.search.fleet} with {self.search.policy}"
        if self.search.policy == self.policy:
            return (
                f"{answer}. The grid has the same requirements and tolerance, but intervals that "
                "hold however often you look, which are wider; where it leaves open what the page "
                "has decided, the page is the evidence."
            )
        return (
            f"{answer}, which this page cannot simulate: its panel has heuristics alone. The grid "
            f"is of {self.policy}, which may need another fleet. So its cheapest fleet may differ "
            "from that of the page, and then both are right, each of its own policy."
        )

    def _default_of(self, baseline: ScenarioSpace, key: str) -> Any:
        """The value of a setting that commands need not name: that of the scenario, if known."""
        if key in self.given:
            return None
        return _value_of(baseline, key)

    def _grid(self, settings: Mapping[str, Sequence[Any]]) -> dict[str, list[int]] | None:
        """The positions of the fleets of the buyer's grid: those of a search with prices."""
        if not self.requirements or self.costs is None or not {*_COUNTS} <= {*settings}:
            return None
        positions = {}
        for key in _COUNTS:
            values = self.varied.get(key) or [_value_of(self.spaces[0], key)]
            numbers = [value for value in values if value in settings[key] and is_number(value)]
            if not numbers:
                return None
            numbers = [numbers[place * (len(numbers) - 1) // (_SIDE - 1)] for place in range(_SIDE)]
            positions[key] = sorted({settings[key].index(number) for number in numbers})
        return positions


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
            key: [value for value in values if is_number(value) or key in _OF_SHEET]
            for key, values in varied.items()
            if key in _OFFERED
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
        policy=next((name for name in policies if name in KINDS), "greedy"),
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


def check_panel(panel: Panel, page: str) -> list[str]:
    """What is wrong with the panel of a page, a line for each; nothing of what it has shown counts.

    The panel is made again, with its module, its arrays and the hashes of its missions, and must
    have the same bytes. A panel of another version of the module has only its missions checked.

    Args:
        panel: What the page says that its panel is made of.
        page: The text of the page.
    """
    if is_of_another_version(panel):
        own = re.findall(_HASH, panel.render())
        return [
            f"mission {number} of its baseline differs"
            for number, digest in enumerate(own)
            if digest not in page
        ]
    if _is_in(panel.render(), page):
        return []
    return ["differs from the panel that the same settings give: its module, arrays or missions"]


def _is_in(rendered: str, page: str) -> bool:
    """Whether a page has a panel; what is packed may have been compressed in another way."""
    *parts, end = _PACKED.split(rendered)
    place = page.find(parts[0])
    if place < 0:
        return False
    for text, packed in zip(parts[::2], parts[1::2], strict=True):
        if not page.startswith(text, place):
            return False
        place += len(text)
        theirs = _ENCODED.match(page, place)
        if theirs is None or not _is_packed_as(theirs.group(), packed):
            return False
        place = theirs.end()
    return page.startswith(end, place)


def _is_packed_as(theirs: str, packed: str) -> bool:
    """Whether a packed text has the content of another; no more of it is unpacked than this has."""
    content = gzip.decompress(b64decode(packed))
    unpack = zlib.decompressobj(wbits=31)
    try:
        return unpack.decompress(b64decode(theirs), len(content) + 1) == content
    except (ValueError, zlib.error):
        return False


def is_of_another_version(panel: Panel) -> bool:
    """Whether a panel has another module than the one that is installed."""
    return panel.module != sha256(read_module()).hexdigest()


def hash_missions(space: ScenarioSpace, policy: str, seed: int, fleet: int) -> list[str]:
    """The SHA-256 hashes of the records of the first missions, as the module writes them.

    Args:
        space: The scenario.
        policy: The policy of all UAVs.
        seed: The seed of the missions.
        fleet: The number of UAVs for which a record has room.
    """
    records = simulate_batch(space, [load(policy)], seed, CHECKED)
    padded = _with_room(records, fleet)
    return [
        sha256(b"".join(kind[row].tobytes() for kind in padded if len(kind))).hexdigest()
        for row in range(CHECKED)
    ]


def _with_room(records: Records, fleet: int) -> Records:
    """Records with room for a fleet, and for what extended scenarios measure."""
    padded = empty_records(len(records.missions), fleet, is_extended=True)
    padded.missions[:] = records.missions
    padded.uavs[:, : records.uavs.shape[1]] = records.uavs
    if len(records.operations):
        padded.operations[:] = records.operations
    return padded


def _settings_of(
    baseline: ScenarioSpace,
    variation: ScenarioSpace,
    varied: Mapping[str, Sequence[Any]] = MappingProxyType({}),
) -> Iterator[tuple[str, list[Any]]]:
    """The settings of the panel: by field, the values that the scenario allows, in their order."""
    ours, theirs = (dotted(space.model_dump(mode="json")) for space in (baseline, variation))
    differing = [key for key in ours | theirs if ours.get(key) != theirs.get(key)]
    if _MTBF in differing and not all(space.value(_MTBF) for space in (baseline, variation)):
        # The sheet of one side says nothing of failures: they are told by what follows from it.
        differing = [key for key in differing if key not in (_MTBF, "data_sheet.repair")]
        differing.append("failures.uav_repair")
    # Another line of the data sheet would change the same words of the arrays.
    has_other_sheet = any(key.startswith("data_sheet.") for key in {*differing} - {*_OF_SHEET})
    for key in _OFFERED:
        if key in _OF_SHEET and has_other_sheet:
            continue
        if not _has_setting(baseline, key) or not _has_setting(variation, key):
            continue
        present = [_value_of(space, key) for space in (baseline, variation)]
        values = [*_candidates_of(baseline, key, present), *varied.get(key, ())]
        allowed = [value for value in values if _is_allowed(baseline, key, value)]
        ordered = _in_order(key, [*allowed, *present])
        if len(ordered) > 1:
            yield key, ordered
            differing = [other for other in differing if other != key]
    for key in differing:
        values = [_value_of(space, key) for space in (baseline, variation)]
        if values[0] != values[1]:
            yield key, values


def _candidates_of(space: ScenarioSpace, key: str, present: Sequence[Any]) -> Sequence[Any]:
    """The values of a setting that are offered on any page."""
    if key in (*_COUNTS, ZONE_PADS):
        usual = _COUNTS.get(key, _COUNTS["pads"])
        most = max([usual, *(value for value in present if isinstance(value, int))])
        return range(1, min(most, _MOST_POSITIONS) + 1)
    if key in _OF_SHEET:
        return [_times(space.plain_value(key), factor) for factor in _OF_SHEET[key][1]]
    if key in _SCALED:
        value = getattr(space, key)
        scaled = [float(f"{factor * value:.6g}") for factor in _SCALED[key]]
        return [*map(round, scaled)] if isinstance(value, int) else scaled
    return _LEVELS[key]


def _has_setting(space: ScenarioSpace, key: str) -> bool:
    """Whether a scenario has what a setting changes: further zones, or a line of its data sheet."""
    if key == ZONE_PADS:
        return bool(space.zones)
    if key in _OF_SHEET:
        return bool(space.units and space.value(key))
    return True


def _times(value: Any, factor: float) -> Any:
    """What a data sheet says, times a factor: a text, or one for each node."""
    if factor == 1.0:
        return value
    if isinstance(value, str):
        return times(value, factor)
    return [times(of_node, factor) for of_node in value]


def _amount_of(key: str, value: Any) -> float:
    """The amount of what a data sheet says; of a list for the nodes, that of the first."""
    if not isinstance(value, str):
        value = value[0]
    return measured(value, _OF_SHEET[key][0])[0]


def _is_allowed(space: ScenarioSpace, key: str, value: Any) -> bool:
    try:
        ScenarioSpace.of(space, **{key: value})
    except InputError:
        return False
    return True


def _value_of(space: ScenarioSpace, key: str) -> Any:
    """The value of a field as a reader knows it: of a range with equal ends, one number."""
    if key == "pads" and space.pads is None:
        *_, width, height = space.zone
        return width * height
    value = space.plain_value(key)
    if key == ZONE_PADS and len({*value}) == 1:
        return value[0]
    if key in RANGES and value[0] == value[1]:
        return value[0]
    return value


def _in_order(key: str, values: Sequence[Any]) -> list[Any]:
    """Each value once: ranges, which differ between missions, before numbers.

    What a data sheet says is in the order of the amounts.
    """
    different = [value for n, value in enumerate(values) if value not in values[:n]]
    if key in _OF_SHEET:
        return sorted(different, key=partial(_amount_of, key))
    numbers = sorted(value for value in different if not isinstance(value, list))
    return [value for value in different if isinstance(value, list)] + numbers


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


def _describe_setting(
    key: str, values: Sequence[Any], space: ScenarioSpace, default: Any
) -> dict[str, Any]:
    """A setting for the page; a command need not name the default, which the scenario has."""
    field = field_named(key)
    place = ""
    if key == "pads" and space.zones:  # those of the other zones are settings of their own
        place = " in zone 1"
    name, unit = field.name, field.unit
    texts = [value_text(value) for value in values]
    if key in _FAILURES:
        name, unit = _failure_in_words(space), ""
        texts = [_time_between(value, space.units) for value in values]
    if key in _OF_SHEET and not isinstance(values[0], str):
        listed = _amount_of(key, space.plain_value(key))
        texts = [f"{_amount_of(key, of_nodes) / listed:g} times the sheet's" for of_nodes in values]
    return {
        "default": values.index(default) if default in values else None,
        "key": key,
        "name": name + place,
        "place": place,
        "unit": unit,
        "values": values,
        "texts": texts,
        "options": [f"{key}={toml_value(value)}" for value in values],
    }


def _time_between(rate: float | str, units: Units | None) -> str:
    """A rate per mission slot, or a time, as the mean time from one event to the next."""
    if isinstance(rate, str):
        return f"one every {rate}"
    if rate == 0.0:
        return "none"
    if units is None:
        return f"one every {format_quantity(1 / rate)} mission slots"
    return f"one every {format_quantity(size_of('h', units) / rate)} h"


def _failure_in_words(space: ScenarioSpace) -> str:
    """What a failure of a UAV does, and for how long."""
    repair = space.failures.uav_repair
    if repair == 0.0:
        return "Failures of a UAV in flight, which is then lost for good"
    length = f"{format_quantity(repair)} mission slots"
    if space.units:
        length = printed(repair * space.units.slot, "s")
    return f"Failures of a UAV in flight, which is then grounded for {length} in the mean"


def _describe_prices(costs: Costs | None) -> Iterator[dict[str, Any]]:
    """The prices that a reader may change, in the order in which the module has them."""
    if costs is None:
        return
    names = list(PRICES[: PRICES.index("seconds")])
    if costs.years is None:
        names = names[: names.index("pack")]
    else:
        names[names.index("missions")] = "days"
    for name in names:
        value = getattr(costs, name)
        if name == "lost_uav" and value is None and not costs.pays_for_losses:
            value = 0.0
        yield {
            "name": name,
            "label": _PRICED[name],
            "value": value,
            "least": int(name in (*_WHOLE, "pack_cycles")),
            "most": _MOST.get(name, _MOST_AMOUNT),
            "isWhole": name in _WHOLE,
        }


def _other_prices(costs: Costs | None) -> Iterator[str]:
    """What commands say of prices beside them."""
    if costs is not None:
        yield f"currency={costs.currency}"
        if costs.slot_seconds is not None:
            yield f"slot_seconds={costs.slot_seconds:g}"
        if costs.years is not None:
            yield f"years={costs.years:g}"
            yield f"interest={costs.interest:g}"


def _describe_metrics(
    space: ScenarioSpace, costs: Costs | None, search: Search | None = None
) -> Iterator[dict[str, Any]]:
    """What the panel writes of each metric, by its column in the values of missions."""
    tolerance = Cheapest.model_fields["tolerance"].default
    if search is not None:
        tolerance = search.tolerance
    offered = {*METRICS[: METRICS.index("reward")], *measures_of(space)}
    if costs is not None:
        offered.add("cost")
    for column, name in enumerate(METRICS):
        metric = metric_of(name)
        if metric.kind == "cost" and costs is not None:
            metric = replace(metric, unit=costs.unit)
        if space.units:
            metric = metric.in_units
        yield {
            "column": column,
            "key": name,
            "name": metric.name,
            "percent": metric.in_percent,
            "unit": metric.unit,
            "less": metric.less_is_better,
            "neutral": metric.is_neutral,
            "isOutcome": metric.is_outcome,
            "isOffered": name in offered and not metric.is_neutral,
            "isListed": name == PRODUCT or (name == "cost" and costs is not None),
            "option": _REQUIRED.get(name, ""),
            "tolerance": _tolerance_of(name, tolerance, space),
            "suffix": f" {metric.unit}" if name == AGE and space.units else "",
        }


def _tolerance_of(name: str, share: float, space: ScenarioSpace) -> float:
    """How far from a bound of a metric either verdict of the grid is right."""
    if name == AGE:
        return share * horizon_of(space)
    if name in _REQUIRED:
        return share
    return 0.0


def _describe_requirements(
    requirements: Mapping[str, float], metrics: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, str]]:
    """The metric and the bound of each line of requirements; there is one line at least."""
    percent = {metric["key"]: metric["percent"] for metric in metrics}
    for name, bound in requirements.items():
        yield name, f"{100 * bound if percent[name] else bound:.10g}"
    if not requirements:
        yield "", ""


def describe_example() -> dict[str, Any]:
    """What the index of pages simulates: fleets and data of the paper's sea.

    It is a file of the package, so that an index is made without simulating:
    ``python tools/wasm/make_example.py`` writes it.
    """
    space, other = (ScenarioSpace.of(PAPER, uavs=uavs) for uavs in (3, 4))
    settings = {
        key: values for key, values in _settings_of(space, other) if key in _EXAMPLE_SETTINGS
    }
    image = make_image(space, ["greedy"], 0, PORTION, settings)
    starts = {
        side: [values.index(_value_of(version, key)) for key, values in settings.items()]
        for side, version in (("a", space), ("b", other))
    }
    return {
        "module": sha256(read_module()).hexdigest(),
        "data": {
            "policy": "greedy",
            "settings": [
                _describe_setting(key, values, space, _value_of(space, key))
                for key, values in settings.items()
            ],
            "metrics": [metric for metric in _describe_metrics(space, None) if metric["isOffered"]],
            "start": starts,
        },
        "image": image.document(),
    }
