"""Files of studies: the shipped ones by their names, and those of users."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dess.analysis.study.fields import StudyData
from dess.analysis.study.study import Study, study_from
from dess.base.errors import unknown_name
from dess.base.files.reading import Shipped
from dess.physics.section import plain
from dess.policies.registry import list_teams
from dess.scenario.scenario import is_scenario_name

_STUDIES = Shipped("study", "dess.analysis.study", "shipped")


def load_study(
    name_or_path: str | Path, /, *, processes: Sequence[str] = (), **overrides: Any
) -> Study:
    """A shipped study by name, or one from a TOML file.

    Args:
        name_or_path: One of ``study_names()``, or the path of a TOML file. If the file gives no
            name, the study is named after the file. A scenario file is looked for in its folder.
        processes: Further processes of every mission, ``FILE.py:FUNCTION`` each.
        **overrides: Fields of ``Study`` that replace those of the file. If ``missions`` is less
            than ``logged``, ``logged`` is reduced to it.

    Raises:
        InputError: If there is no such study, or it is not valid; or if the file, not ``policies``
            among the overrides, names a policy of a Python file, which is code.
    """
    text = str(name_or_path)
    overrides = {name: plain(value) for name, value in overrides.items()}
    where, values = _STUDIES.load(name_or_path)
    values = {"name": text if text in study_names() else Path(text).stem} | values
    scenario = values.get("scenario")
    if isinstance(scenario, str) and not is_scenario_name(scenario):
        values["scenario"] = str(Path(text).parent / scenario)
    if "policies" in overrides:
        overrides["policies"] = list_teams(overrides["policies"])
    values |= _with_fewer_logs(values, overrides)
    if unknown := sorted(values.keys() - Study.model_fields.keys()):
        raise unknown_name(f"{where}: {unknown[0]}", "unknown key", unknown[0], Study.model_fields)
    return study_from(
        values,
        where,
        run_files="policies" in overrides,
        processes=processes,
        origin=(text, overrides),
    )


def _with_fewer_logs(values: dict[str, Any], overrides: dict[str, Any]) -> dict[str, Any]:
    """The overrides, with ``logged`` reduced if there are fewer missions than that."""
    logged = values.get("logged")
    missions = overrides.get("missions")
    if isinstance(logged, int) and isinstance(missions, int) and 1 <= missions < logged:
        return {"logged": missions} | overrides
    return overrides


def study_names() -> list[str]:
    """The names of the shipped studies."""
    return _STUDIES.names()


def study_descriptions() -> dict[str, str]:
    """The descriptions of the shipped studies by their names; no study is made or checked."""
    return {name: _STUDIES.load(name)[1].get("description", "") for name in study_names()}


def budget_of(study: StudyData) -> str:
    """In words, how a study differs from the shipped study of the same name; none is loaded."""
    if study.name not in study_names():
        return "as asked"
    shipped = StudyData.model_validate({"name": study.name, **_STUDIES.load(study.name)[1]})
    policies = {*study.policies}
    missions = study.missions
    words = []
    if policies < {*shipped.policies}:
        words.append(f"{len(policies)} of {len(shipped.policies)} policies")
    elif policies != {*shipped.policies}:
        words.append("other policies")
    if missions != shipped.missions:
        words.append(f"{missions:,} instead of {shipped.missions:,} missions")
    others = StudyData.model_fields.keys() - {"policies", "missions", "description", "engine"}
    changed = [key for key in sorted(others) if getattr(study, key) != getattr(shipped, key)]
    return ", ".join([*words, *(f"another {key}" for key in changed)]) or "full"
