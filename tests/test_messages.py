"""What any model refuses is told in one line: where, what, and what is allowed."""

import ast
import json
import re
from collections.abc import Iterator
from copy import deepcopy
from functools import reduce
from operator import getitem
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from dess import InputError
from dess.analysis.answers.policies.decision_times import Times
from dess.analysis.ask.limits import Limits
from dess.analysis.results.evidence import Evidence
from dess.analysis.results.manifest import Manifest
from dess.analysis.study.study import Study
from dess.analysis.wasm.module import About
from dess.base.files.documents import Document
from dess.model.record import MISSION_RECORD
from dess.policies.learner.checkpoint import Header
from dess.policies.learner.config import TrainingConfig, load_config
from dess.policies.learner.description import Description
from dess.policies.registry import TRAINED
from dess.reports.pages.page import Card, Learned
from dess.reports.pages.panel import Panel
from dess.scenario.no_fly import NoFlyFile
from dess.scenario.nodes import NodesFile
from dess.scenario.own_sea import ZonePlace
from dess.scenario.readers.geojson import Features
from dess.scenario.readers.plan import _PlanDocument
from dess.scenario.scenario import Scenario, ScenarioSpace, validated
from tests.test_architecture import FLOORS, SOURCES

SECTIONS = {
    "arrivals": {"process": "continuous", "schedule": [[0, 1.0]], "buffer": 3},
    "age": {"measured": True},
    "charging": {"measured": True},
    "failures": {"uav_rate": 0.1},
    "wind": {"strength": 0.1},
    "fleet": [{"quota": 4}],
}
DESIGNS: list[dict[str, Any]] = [
    {"kind": "grid", "values": {"uavs": [1, 2]}},
    {"kind": "one-at-a-time", "values": {"uavs": [1, 2]}},
    {"kind": "table", "rows": [{"uavs": 1}, {"uavs": 2}]},
    {"kind": "latin-hypercube", "ranges": {"uavs": [1, 2]}, "size": 2},
    {"kind": "saltelli", "ranges": {"uavs": [1, 2]}, "base": 2},
]
RULES: list[dict[str, Any]] = [
    {"precision": {"targets": {"success": {"absolute": 0.1}}}},
    {"selection": {"procedure": "kn", "metric": "reward", "indifference": 1.0}},
    {
        "selection": {
            "procedure": "cheapest",
            "requirements": {"success": 0.9},
            "indifference": 1.0,
        },
        "costs": {"currency": "EUR", "uav": 1.0, "years": 5.0, "days": 200},
    },
]
ROW = {
    **dict.fromkeys(("tick", "uav_slots", "updates"), 1),
    **dict.fromkeys(("seconds", "epsilon", "learning_rate", "moving_average"), 0.5),
    **{"phase": "one", "is_best": True},
}
METRICS = ("success", "collection_ratio", "collection_ratio_and_communication", "reward")


def study(**changes: Any) -> dict[str, Any]:
    return {"name": "trial", "policies": ["greedy"], "design": DESIGNS[0]} | changes


def documents() -> Iterator[tuple[type[BaseModel], dict[str, Any]]]:
    """Valid JSON documents, as plain data."""
    data = Manifest.of(Study.model_validate(study(missions=2))).data
    data["code"] = {"dess.model.batch": "0" * 64}
    data["accepted"] = [{"modules": {"dess.model.batch": ["0" * 64, ""]}, "missions": 1}]
    yield Manifest, data
    origin = {name: data[name] for name in Evidence.model_fields.keys() & data.keys()}
    record = dict.fromkeys(MISSION_RECORD.names or (), 0)
    mission = {"policy": "greedy", "values": {"uavs": 1}, "replication": 0, "record": record}
    drawn = {"key": "0" * 16, "points": 2, "missions": [2, 2], "sample": [mission]}
    yield Evidence, origin | drawn
    cost = {"policy": "greedy", "calls": 1, "median": 1e-6, "slow": 1e-6}
    yield Times, {"processor": "x", "costs": [cost]}
    point = {"type": "Point", "coordinates": [1.0, 2.0]}
    yield Features, {"features": [{"geometry": point, "properties": {"Name": "A"}}]}
    yield Card, {"title": "", "finding": "", "picture": {"alt": "", "source": "", "narrow": ""}}
    yield Learned, {"files": {"a": ""}}
    scenario = {"scenario": "paper", "given": {}, "baseline": {}, "variation": {}}
    yield Limits, {"missions": 1, "limits": [], "has_wind": False}
    yield Panel, scenario | {"policy": "greedy", "seed": 0, "module": "", "costs": {"uav": 1.0}}
    yield About, {"module": "", "code": "", "built_with": {"numba": "1"}}
    circle = {"circle": {"center": [1.0, 2.0], "radius": 9.0}, "inclusion": False}
    polygon = {"polygon": [[1.0, 2.0], [1.0, 3.0], [2.0, 2.0]], "inclusion": True}
    yield _PlanDocument, {"geoFence": {"polygons": [polygon], "circles": [circle]}}
    geometries = {"type": "GeometryCollection", "geometries": [point]}
    yield Features, {"features": [{"geometry": geometries}]}


def tables() -> Iterator[tuple[type[BaseModel], dict[str, Any]]]:
    """Valid tables, as TOML and the files of trainings have them."""
    yield Scenario, Scenario.of(**SECTIONS).model_dump(mode="json")
    yield ScenarioSpace, ScenarioSpace.of(**SECTIONS).model_dump(mode="json")
    yield NodesFile, {"file": "n.csv", "where": {"A": "B"}, "place": "merge", "name": "C"}
    yield NoFlyFile, {"file": "n.json", "touched": True, "width": 1.0, "colours": ["#ff0000"]}
    yield ZonePlace, {"lon": 1.0, "lat": 2.0, "width": 3, "height": 4}
    for design in DESIGNS:
        yield Study, study(missions=1, design=design)
    for rule in RULES:
        yield Study, study(**rule)
    config = load_config("quick").model_dump(mode="json")
    yield TrainingConfig, config
    yield Description, json.loads((TRAINED / "ddqn" / "config.json").read_text("utf-8"))
    progress = dict.fromkeys(("tick", "updates", "uav_slots", "phase_index", "phase_start"), 1)
    state = {"state": {"state": 1, "inc": 1}, "has_uint32": 0, "uinteger": 0}
    yield (
        Header,
        {
            **{"format": 2, "config": config, "scenario": {}, "observation_version": 1},
            "progress": progress | {"seconds": 0.5, "scores": [0.5], "best_score": 0.5},
            "random": {"bit_generator": "PCG64", **state},
            **{"stepper": [1, 1], "replay": 1, "sha256": "0" * 64},
            "curve": [ROW | {f"evaluation_{metric}": 0.5 for metric in METRICS}],
        },
    )


EXAMPLES = [*documents(), *tables()]
ODD: list[Any] = [
    *(None, True, -1, 0, 1.5, 10**30, float("inf"), "", "?", "\x1b", "x" * 5000),
    *([], [1], [[1, "x"]], ["x"], [1] * 1_500, {}, {"x": 1}, {"uavs": "x"}),
]
LINE = re.compile(r"input: \S.*; allowed: \S.*")
LONGEST = 400
# How pydantic's own messages begin.
FOREIGN = re.compile("Input should|Value error|Extra inputs|Field required|(List|Tuple|String) sho")

# Parts of documents that are among the examples themselves.
OWN = ("scenario", "constants", "study", "training", "config")
Place = tuple[str | int, ...]


def places(data: Any, above: Place = ()) -> Iterator[Place]:
    """The places of a document; of a list only the first item."""
    items = data.items() if isinstance(data, dict) else enumerate(data[:1])
    for key, inner in items:
        yield (*above, key)
        if isinstance(inner, dict | list) and key not in OWN:
            yield from places(inner, (*above, key))


def changes(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The document with an odd value at a place, without the place, and with an unknown key."""
    for place in [*places(data)]:
        copy = deepcopy(data)
        *above, last = place
        table = reduce(getitem, above, copy)
        for odd in ODD:
            table[last] = odd
            yield copy
        del table[last]
        yield copy
        if isinstance(table, dict):
            table["unheard"] = 1
            yield copy


def refusal(model: type[BaseModel], data: Any) -> str:
    """The line about data that a model refuses, as its files are read; empty if it does not."""
    try:
        if issubclass(model, Document):
            model.parse(json.dumps(data), "input")
        else:
            validated(model, data, "input")
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("model", "data"), [pytest.param(*pair, id=pair[0].__name__) for pair in EXAMPLES]
)
def test_every_refusal_says_where_what_and_what_is_allowed(model, data):
    assert refusal(model, data) == ""
    lines = [line for odd in changes(data) if (line := refusal(model, odd))]
    assert lines
    for line in lines:
        assert LINE.fullmatch(line)
        assert not FOREIGN.search(line)
        assert len(line) < LONGEST


def test_every_error_of_input_says_what_is_allowed():
    for module, tree in SOURCES.items():
        calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        for call in calls:
            if isinstance(call.func, ast.Name) and call.func.id == "InputError":
                is_passed_on = isinstance(call.args[0], ast.Starred)
                assert is_passed_on or len(call.args) == 3, (module, ast.unparse(call))


def test_every_model_is_among_the_examples():
    reached = {found for model, _ in EXAMPLES for found in models_in(model)}
    assert {model for model in ours() if not model.__subclasses__()} <= reached


def ours() -> set[type[BaseModel]]:
    """All models of the project."""
    return {m for m in below(BaseModel) if m.__module__.partition(".")[0] in FLOORS}


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models in a type, and in the fields of these models."""
    for part in get_args(annotation):
        yield from models_in(part)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from models_in(field.annotation)


def below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """The classes that inherit from a model."""
    for child in model.__subclasses__():
        yield child
        yield from below(child)
