"""What the results of a page were made with, as tables and as hidden evidence."""

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pandas as pd
from IPython.display import HTML

from dess.analysis.numbers import format_span
from dess.analysis.results.evidence import Evidence, learned_files
from dess.analysis.results.tables import Results
from dess.analysis.study.files import budget_of
from dess.reports.pages.page import STUDY, Learned, hidden_element
from dess.reports.pages.tables import make_table

STUDIES_BESIDE = 3  # studies with a column in one table of what they were made with
SHORT = 12  # characters of a hash that are shown


def provenance_table(studies: Iterable[Results]) -> HTML:
    """A table of what the studies of a page were made with, with the evidence to verify them."""
    return evidence_tables([Evidence.of(results) for results in studies])


def evidence_tables(evidence: Sequence[Evidence]) -> HTML:
    """Tables of what studies were made with, a column for each, and hidden elements with it all.

    Args:
        evidence: The evidence of the studies.
    """
    starts = range(0, len(evidence), STUDIES_BESIDE)
    tables = [_origin_table(evidence[start : start + STUDIES_BESIDE]).data for start in starts]
    inside = [hidden_element(STUDY, json.dumps(of_study.data)) for of_study in evidence]
    return HTML("".join([*tables, *inside]))


def _origin_table(evidence: Sequence[Evidence]) -> HTML:
    names = [of_study.study.name for of_study in evidence]
    columns = {
        name if names.count(name) == 1 else f"{name} {e.key}": {
            "Scenario": e.study.scenario,
            "Policies": ", ".join(team.policy for team in e.policies),
            "Weights": ", ".join(_name_weights(e)) or "none",
            "Design points": f"{e.points:,}",
            "Missions per policy and point": format_span(e.missions),
            "Budget": budget_of(e.study),
            "Seed": e.seed,
            "Engine": e.study.engine,
            "Study key": e.key,
            "dess": e.version,
            "Code": e.engine_code[:SHORT],
            "Processes": ", ".join(f"{p.process} {p.code[:SHORT]}" for p in e.processes),
            "Accepted": "; ".join(change.text for change in e.accepted),
            "Commit": (e.commit or "unknown")[:SHORT],
            "Libraries": ", ".join(f"{name} {version}" for name, version in e.libraries.items()),
        }
        for name, e in zip(names, evidence, strict=True)
    }
    frame = pd.DataFrame(columns).rename_axis("Study")
    if not any(e.accepted for e in evidence):
        frame = frame.drop("Accepted")
    if not any(e.processes for e in evidence):
        frame = frame.drop("Processes")
    return make_table(frame.reset_index(), wrap=True)


def weights_table(folder: Path) -> HTML:
    """A table of the files of the learned policies in a folder, and the evidence to verify it."""
    files = learned_files(folder)
    rows = [(name, digest[:SHORT]) for name, digest in files.items()]
    shown = make_table(pd.DataFrame(rows, columns=["File", "SHA-256"]), "The learned policies")
    return HTML(f"{shown.data}{Learned(files=files).hidden}")


def _name_weights(evidence: Evidence) -> Iterator[str]:
    """The names of the learned policies of a study with the hashes of their weights."""
    for name, digest in dict.fromkeys(
        (team.policy if len(team.members) == 1 else member.name, member.weights)
        for team in evidence.policies
        for member in team.members
    ):
        if digest:
            yield f"{name} {digest[:SHORT]}"
