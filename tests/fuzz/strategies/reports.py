"""The shipped reports on forged folders: their studies, and what lies beside these."""

from hypothesis import strategies as st

from dess.analysis.results.chunks import DERIVED
from dess.reports.pages.missing import TIMED
from dess.reports.pages.notebook import read_report
from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import copy
from tests.fuzz.strategies import commands
from tests.fuzz.strategies.changes import Changes, json_changes, odd, results_changes
from tests.fuzz.strategies.values import texts, toml_values

_RESULTS = "out/results"
# Folders that a report reads beside those of its studies.
_BESIDE = {
    "performance": ("gap",),
    "scorecard": ("gap",),
}
_ASKING = ("what-if", "sweep", "own-sea")  # reports that keep the results of a question
_TRAINED = "in/trained"


@st.composite
def reports(draw: st.DrawFn, name: str, special: Changes | None = None) -> Case:
    """A shipped report, one of whose folders is changed, in a special way or any."""
    studies, beside = read_report(name).studies, _BESIDE.get(name, ())
    folders = [*studies, *beside]
    steps: list[Step] = [copy(f"{ready.REPORTS}/{one}", f"{_RESULTS}/{one}") for one in folders]
    changes = [results_changes(f"{_RESULTS}/{one}") for one in folders]
    if name in TIMED:  # the times of decisions, which are kept in the folder of the study
        changes.append(json_changes(f"{_RESULTS}/{TIMED[name]}/{DERIVED}"))
    known = read_report(name).parameters
    parameters = {key: text for key, text in ready.ASKED_WITH.items() if key in known}
    if name in _ASKING:
        steps += [copy(ready.ASKED, _RESULTS), copy(ready.SCENARIO, f"in/{ready.SCENARIO}")]
        changes.append(json_changes(_RESULTS))
    if name == "learning":
        steps.append(copy(ready.TRAINED, _TRAINED))
        changes.append(json_changes(_TRAINED))
        parameters["trained"] = f'"../{_TRAINED}"'
    if special:
        whole = _TRAINED if name == "learning" else _RESULTS
        parts = [f"{_RESULTS}/{one}" for one in beside if special is odd]
        changes = [special(draw(st.sampled_from([whole, *parts])))]
    steps += draw(st.lists(st.one_of(changes), min_size=1, max_size=1 if special else 2))
    if not special and draw(st.integers(0, 5)) == 5:
        some = st.sampled_from([*known, "policies"]) | texts
        parameters[draw(some)] = draw(toml_values)
    given = [f"--parameter={key}={value}" for key, value in parameters.items()]
    values = {"report names": name, "--results": f"../{_RESULTS}"}
    arguments = (*commands.line(("report",), values), *given)
    return Case("report", arguments, tuple(steps), seconds=120)
