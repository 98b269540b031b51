"""A sweep as a study: made from values of fields, stored under a name, and run.

    study = question({"uavs": [2, 3, 4], "pads": [1, 2, 3], "quota": [600]}, "my-sea.toml")
    results = ask(study, "results")  # in results/sweeps/uavs-pads-0123456789abcdef

The name identifies the question, but not the number of missions; if more are asked for, they are
added to the same folder. Missions that another sweep has already simulated are copied from it. The
file of the study lies beside the folder, so that an interrupted sweep can be completed by
``dess study run results/sweeps/NAME.toml --out results/sweeps/NAME``.
"""

import json
import os
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

import dess
from analysis.execution.dry_run import check_run
from analysis.execution.jobs import Progress
from analysis.execution.runner import Round, run_study
from analysis.names import ALIASES, METRICS, SWEEP, SWEEPS
from analysis.results.chunks import short_hash
from analysis.results.files import MANIFEST
from analysis.results.provenance import engine_code, team_of
from analysis.results.tables import Results
from analysis.study.best import BASELINE, policies_for
from analysis.study.cheapest import Cheapest
from analysis.study.costs import Costs
from analysis.study.design import Grid
from analysis.study.study import Study, study_from
from dess.errors import InputError, one_of
from dess.files.reading import paths_in
from dess.files.writing import write_file
from dess.scenario import is_scenario_name, load_scenario
from policies.registry import typed

LONGEST = 60  # largest number of characters for the fields in a name

# Missions in the search for the cheapest setting: at most, per setting on average and over all
# settings; and with how many of every setting it begins.
BUDGET, ALL, FIRST = 2_000, 1_000_000, 20
# How many a setting takes on average, with those that check the answer: 20 settings of the scenario
# ``bay`` with a success of 99 % took 620 each.
USUAL = 620
LITTLE = 0.01  # as a share of the prices: a saving that does not matter


def question(
    values: Mapping[str, Sequence[Any]],
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
    missions: int = 300,
    seed: int = 0,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float] | None = None,
    name: str | None = None,
) -> Study:
    """The study of a sweep.

    Args:
        values: For each field of the scenario its values. A field with one value is fixed.
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams: ``"P"`` or ``"P,P,..."``. Without any, the best policy that five minutes
            allow, and ``greedy``.
        missions: Number of missions of every setting. With requirements, the number of additional
            missions that check each selected setting.
        seed: Seed of the missions.
        prices: Fields of ``Costs``.
        requirements: For each required metric its lowest acceptable mean. With requirements the
            study searches for the cheapest setting that meets them, and needs prices.
        name: Name of the study. Without one, the name is made of the fields and a hash.

    Raises:
        InputError: If a field, a value, a policy, a price or a requirement is not allowed.
    """
    if unknown := [key for key in prices or () if key not in Costs.model_fields]:
        raise InputError(
            f"prices: {unknown[0]!r} is unknown{one_of(unknown[0], Costs.model_fields)}"
        )
    fixed = {field: of_field[0] for field, of_field in values.items() if len(of_field) == 1}
    swept = {field: of_field for field, of_field in values.items() if len(of_field) > 1}
    load_scenario(scenario, **{field: of_field[0] for field, of_field in values.items()})
    data = {
        "name": "sweep" if name is None else name,
        "description": SWEEP,
        "scenario": str(scenario),
        "set": fixed,
        "design": {"kind": "grid", "values": swept},
        "policies": typed([policies] if isinstance(policies, str) else policies or [BASELINE]),
        "seed": seed,
        **({"costs": dict(prices)} if prices else {}),
        **({} if requirements else {"missions": missions}),
    }
    if requirements:
        data["selection"] = _cheapest(requirements, missions, study_from(data, "sweep"))
    if policies is None:
        spaces = [point.scenario for point in study_from(data, "sweep").points]
        each = max(USUAL, missions) if requirements else missions
        data["policies"] = policies_for(spaces, each)
    study = study_from(data, "sweep")
    return study if name is not None else study.model_copy(update={"name": _name_of(study, swept)})


def folder_of(study: Study, folder: str | Path) -> Path:
    """The results folder of a sweep."""
    return Path(folder) / SWEEPS / study.name


def file_of(study: Study, folder: str | Path) -> Path:
    """The file of the study of a sweep."""
    return Path(folder) / SWEEPS / f"{study.name}.toml"


def command(study: Study) -> str:
    """The command that runs the same sweep."""
    assert isinstance(study.design, Grid)
    fixed = {field: [value] for field, value in study.set.items()}
    values = {**fixed, **study.design.values}
    words = [w for f, of_f in values.items() for w in ("--set", f"{f}={_listed(of_f)}")]
    about = {"policy": study.policies, "missions": [study.missions], "seed": [study.seed]}
    if study.scenario != "paper":
        about["scenario"] = [Path(study.scenario).name]
    words += [
        w for name, of_name in about.items() for w in (f"--{name}", ",".join(map(str, of_name)))
    ]
    prices = study.costs.model_dump(exclude_unset=True) if study.costs else {}
    words += [w for key, amount in prices.items() for w in ("--price", f"{key}={amount}")]
    rule = study.selection
    if isinstance(rule, Cheapest):
        words[words.index("--missions") + 1] = str(rule.check)
        words += [w for m, q in rule.requirements.items() for w in ("--require", f"{m}={q}")]
    return shlex.join(["dess", "sweep", *words])


def _listed(values: Iterable[Any]) -> str:
    return json.dumps([*values])[1:-1].replace(" ", "")


def ask(
    study: Study,
    folder: str | Path,
    workers: int = 1,
    progress: Progress | None = None,
    announce: Callable[[Round], object] | None = None,
    yes: bool = False,
) -> Results:
    """Write the file of a sweep, and simulate the missions that no sweep in the folder has.

    Args:
        study: The study made by ``question``.
        folder: Folder in which results are stored.
        workers: Number of processes.
        progress: As for ``run_study``.
        announce: As for ``run_study``.
        yes: Whether a sweep of any length is allowed.

    Raises:
        InputError: Before anything is written, if a policy cannot act in the scenario, the sweep
            would take long, or another question has the same name; or if the folder cannot be
            written.
        ChunkError: As for ``run_study``.
    """
    out = folder_of(study, folder)
    reuse = others(out)
    check_run(study, out, workers, reuse=reuse, yes=yes)
    write(study, folder)
    return run_study(study, out, workers, None, progress, announce, reuse=reuse)


def others(out: Path) -> list[Path]:
    """The results folders of the other sweeps beside one, whose missions are copied."""
    return [path.parent for path in paths_in(out.parent, f"*/{MANIFEST}") if path.parent != out]


def write(study: Study, folder: str | Path) -> Path:
    """Write the file of the study, which ``dess study run`` reads, and return its path."""
    path = file_of(study, folder)
    data = study.model_dump(mode="json", exclude_unset=True)
    if not is_scenario_name(study.scenario):
        data["scenario"] = Path(os.path.relpath(study.scenario, path.parent)).as_posix()
    write_file(path, tomli_w.dumps(data))
    return path


def _cheapest(requirements: Mapping[str, float], missions: int, study: Study) -> dict[str, Any]:
    """The rule that searches for the cheapest setting that meets the requirements."""
    prices = study.costs
    if not prices:
        raise InputError("requirements: need prices; allowed: prices, such as uav=20000")
    least = {}
    for metric, share in requirements.items():
        full = ALIASES.get(metric, metric)
        if full not in METRICS:
            allowed = one_of(metric, [*METRICS, *ALIASES])
            raise InputError(f"requirements: {metric!r} is unknown{allowed}")
        least[full] = share
    spaces = [point.scenario for point in study.points]
    fleet = prices.uav * max(space.uavs[1] for space in spaces)
    fleet += prices.pad * max(space.charging_pads for space in spaces)
    running = prices.missions * (prices.charge + prices.hour + prices.lost_uav)
    if not fleet and not running:
        raise InputError("prices: all are 0; allowed: one or more above 0")
    return {
        "procedure": "cheapest",
        "requirements": least,
        "indifference": LITTLE * (fleet or running),
        "budget": min(BUDGET * study.size, max(ALL, FIRST * study.size)),
        "first": FIRST,
        "check": missions,
    }


def _name_of(study: Study, fields: Iterable[str]) -> str:
    """A name made of the swept fields, and of a hash of all that the records depend on."""
    data = study.model_dump(mode="json", exclude={"missions": True, "selection": {"check"}})
    about = {
        "version": dess.__version__,
        "engine": engine_code(),
        "teams": [team_of(policy).model_dump(mode="json") for policy in study.policies],
        "base": load_scenario(study.scenario, **study.set).model_dump(mode="json"),
        "study": data | {"scenario": Path(study.scenario).name},
    }
    key = short_hash(json.dumps(about, sort_keys=True).encode())
    return f"{'-'.join(fields)[:LONGEST] or 'sweep'}-{key}"
