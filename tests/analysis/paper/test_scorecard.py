"""The scorecard follows from the results, complete or not: claims, verdicts and figures."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from dess.analysis import load_study, run_study
from dess.analysis.metrics import PRODUCT
from dess.analysis.paper import values as paper
from dess.analysis.paper.measures import (
    ABSENT,
    EXCEEDS,
    FALLS_SHORT,
    MATCHES,
    NO_RESULTS,
    NOT_APPLICABLE,
    SHARED,
    VERDICTS,
    Finding,
)
from dess.analysis.paper.scorecard import (
    DIAGNOSTIC,
    NULLS,
    OPEN,
    PASSED,
    TRAININGS,
    UNTESTED,
    VARIANTS,
    WEAKNESS,
    Row,
    departures_in_words,
    scorecard,
    scorecard_sentence,
)
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from dess.policies.learner.description import read_description
from dess.policies.registry import TRAINED
from tests.analysis.small import grid

NOTEBOOKS = Path(__file__).parents[3] / "reports" / "notebooks"
POLICIES = ["greedy", "random", "random-unguarded", "ddqn"]
RULE = {"procedure": "kn-bounded", "first": 4, "indifference": 0.02, "budget": 20, "check": 4}
NONE = pd.DataFrame()


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """Tiny results of all studies that are read."""
    folder = tmp_path_factory.mktemp("results")
    corners = grid(uavs=[1, 3], initial_data=[[5, 7.5], 10])
    changes: dict[str, dict[str, Any]] = {
        "table4": {"missions": 20},
        "fig4": {"missions": 4, "logged": 2},
        "fig5": {"missions": 3},
        "sweet-spot": {"selection": RULE, "design": corners},
    }
    return {
        name: run_study(load_study(name, policies=POLICIES, **fields), folder / name)
        for name, fields in changes.items()
    }


@pytest.fixture(scope="module")
def trainings():
    """Learning with transfer surely wins, in trainings as long as the paper's."""
    rewards = {"none of the three, long": (0.4, 0.4)}
    return trained({VARIANTS[0]: (0.8, 0.8), VARIANTS[1]: (0.4, 0.4)} | rewards)


def trained(tops: dict[str, tuple[float, float]], length: int = 2 * paper.CROSSING) -> pd.DataFrame:
    """Three trainings of each variant, from one level to another."""
    rows = [
        {
            "variant": variant,
            "seed": seed,
            "phase": "battery",
            "updates": length * step // 8,
            "final_success": 1.0 * (seed == 1),
            "evaluation_reward": np.interp(step, (1, 8), ends) + seed / 1000,
            f"evaluation_{PRODUCT}": np.interp(step, (1, 8), ends) + seed / 1000,
        }
        for variant, ends in tops.items()
        for seed in (1, 2, 3)
        for step in range(1, 9)
    ]
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def rows(studies, trainings):
    return scorecard(studies, trainings)


def row_of(rows: list[Row], words: str) -> Row:
    (row,) = (row for row in rows if words in row.claim.text)
    return row


def learned(rows: list[Row], words: str) -> Finding:
    """The finding by the best learned policy on the claim with these words."""
    return row_of(rows, words).findings[0]


def changed(results: Results, **values: object) -> Results:
    """The same missions of ddqn with other figures."""
    of_policy = results.missions["policy"] == "ddqn"
    missions = results.missions.copy()
    for column, value in values.items():
        missions[column] = missions[column].mask(of_policy, value).astype(float)
    return replace(results, missions=missions)


def test_every_claim_has_a_section_with_its_evidence_and_a_rule(rows):
    assert len(rows) >= 25
    assert len({row.claim.text for row in rows}) == len(rows)
    for row in rows:
        assert row.claim.place and "olds if" in row.rule
        page, _, section = row.claim.page.partition(".html#")
        assert f'<a id="{section}"></a>' in (NOTEBOOKS / f"{page}.py").read_text()
        assert {finding.verdict for finding in row.findings} <= {*VERDICTS}


def test_every_claim_is_judged_by_the_learned_policy_alone(rows):
    for row in rows:
        ours, papers, *nulls = row.findings
        learning = row.claim.study == TRAININGS
        if row.kind == UNTESTED:
            continue
        assert ours.verdict != NO_RESULTS and ours.quantities, ours.note
        assert ours.policy == ("" if learning else "ddqn")
        lacks = "trainings of this policy" if learning else "has no policy ddqn-paper"
        assert papers.verdict == NO_RESULTS and lacks in papers.note
        assert [null.policy for null in nulls] == ([""] * 3 if learning else [*NULLS])


def test_what_holds_above_the_papers_number_exceeds_it():
    """And what holds below it, such as +2.1 [+1.2, +3.0] for +4.4, does not match it."""
    outcomes = {
        Finding(HOLDS, against=ABOVE): EXCEEDS,
        Finding(HOLDS, against=INCONCLUSIVE): MATCHES,
        Finding(HOLDS, against=BELOW): HOLDS,
        Finding(HOLDS): HOLDS,
        Finding(HOLDS, against=ABOVE, weakness=True): SHARED,
        Finding(REFUTED, weakness=True): ABSENT,
        Finding(IN_PART, against=BELOW): FALLS_SHORT,
        Finding(REFUTED): FALLS_SHORT,
        Finding(IN_PART): INCONCLUSIVE,
        Finding(NO_RESULTS): NOT_APPLICABLE,
    }
    assert all(finding.outcome == outcome for finding, outcome in outcomes.items())


@pytest.mark.parametrize(
    ("of_nulls", "weakness", "kind"),
    [
        ((REFUTED, REFUTED, REFUTED), False, DIAGNOSTIC),
        ((REFUTED, NO_RESULTS, NO_RESULTS), False, DIAGNOSTIC),
        ((REFUTED, INCONCLUSIVE, REFUTED), False, OPEN),
        ((NO_RESULTS, NO_RESULTS, NO_RESULTS), False, OPEN),
        ((INCONCLUSIVE, HOLDS, REFUTED), False, PASSED),
        ((REFUTED, REFUTED, REFUTED), True, WEAKNESS),
    ],
)
def test_a_claim_is_diagnostic_if_policies_without_learning_are_shown_to_fail(
    rows, of_nulls, weakness, kind
):
    verdicts = (HOLDS, NO_RESULTS, *of_nulls)
    findings = tuple(Finding(verdict, weakness=weakness) for verdict in verdicts)
    claim = rows[0].claim._replace(weakness=weakness)
    row = Row(claim, "a rule", findings)
    assert row.kind == kind
    passed = "that tell learning from chance, the best learned policy passes 1"
    assert (passed in scorecard_sentence([row])) == (kind == DIAGNOSTIC)
    shown = f"is shown to have {weakness:d} of {weakness:d} weaknesses"
    assert shown in scorecard_sentence([row])


def test_a_verdict_uses_the_intervals_that_are_shown(rows):
    """That on sectors is about the share above chance, that on ignored nodes about a difference."""
    sectors = learned(rows, "divide the nodes into two sectors")
    own, by_chance, more, _ = sectors.quantities
    assert more.interval.mean == pytest.approx(own.interval.mean - by_chance.interval.mean)
    assert more.interval.low < more.interval.mean < more.interval.high
    ignored = learned(rows, "ignores the leftmost")
    assert [quantity.unit for quantity in ignored.quantities] == ["share", "points"]
    for row in rows:
        for finding in row.findings:
            if row.claim.printed and finding.against:
                first, beyond = finding.quantities[:2]
                assert beyond.name == "minus the paper's"
                gap = first.interval.mean - row.claim.printed.interval.mean
                assert beyond.interval.mean == pytest.approx(gap)


def test_without_results_there_are_no_verdicts(rows):
    empty = scorecard({}, NONE)
    assert [row.claim.text for row in empty] == [row.claim.text for row in rows]
    for row in empty:
        for finding in row.findings:
            assert finding.verdict == NO_RESULTS and finding.note


def test_a_single_mission_tells_nothing(studies):
    alone = studies["table4"].missions.query("replication == 0")
    for row in scorecard({"table4": replace(studies["table4"], missions=alone)}, NONE):
        assert row.findings[0].verdict == (
            INCONCLUSIVE if row.claim.study == "table4" else NO_RESULTS
        )


def test_learning_is_judged_by_the_curves(rows):
    higher, passes, levels, rewards, *untested = (
        row for row in rows if row.claim.study == TRAININGS
    )
    assert {row.kind for row in untested} == {UNTESTED} and len(untested) == 4
    assert all(row.findings[0].note.startswith("not tested: no ") for row in untested)
    assert "Nothing here tests 4." in scorecard_sentence(rows)
    share, length = rewards.findings[0].quantities
    assert share.interval.mean == pytest.approx(1 / 3)
    assert length.interval.mean == 2 * paper.CROSSING
    assert rewards.findings[0].verdict == INCONCLUSIVE  # of 3 trainings, one tells nothing
    assert {row.findings[0].verdict for row in (higher, passes, levels)} == {HOLDS}
    assert passes.findings[0].quantities[0].interval.mean == pytest.approx(0.4)
    assert higher.findings[0].note == "trainings quick and no transfer: is above in all of phase II"


def test_the_best_learned_policy_is_judged(tmp_path):
    """Of several learners that with the higher product, never a heuristic."""
    study = load_study("table4", policies=["greedy", "ddqn", "ddqn-paper"], missions=2)
    table4 = run_study(study, tmp_path / "table4")
    row = row_of(scorecard({"table4": table4}, NONE), "Collection ratio over")
    assert (row.findings[0].policy, row.findings[1].policy) == ("ddqn", "ddqn-paper")
    poor = changed(table4, **{PRODUCT: 0.0})
    row = row_of(scorecard({"table4": poor}, NONE), "Collection ratio over")
    best, papers = row.findings[:2]
    assert best.quantities == papers.quantities and best.policy == papers.policy == "ddqn-paper"


def test_a_short_training_of_the_papers_network_cannot_tell(tmp_path):
    """Its failures say nothing of the paper's learner, and its length is a departure."""
    study = load_study("table4", policies=["greedy", "ddqn", "ddqn-paper"], missions=40)
    judged = scorecard({"table4": run_study(study, tmp_path / "table4")}, NONE)
    of_table = [row.findings[1] for row in judged if row.claim.study == "table4"]
    assert {finding.verdict for finding in of_table} == {INCONCLUSIVE}
    assert all("30,000 updates; too short to tell" in finding.note for finding in of_table)
    assert row_of(judged, "Success over").findings[0].verdict == HOLDS
    departures = departures_in_words(read_description(TRAINED / "ddqn-paper").training)
    assert any(words.startswith("its length, 30,000 updates") for words in departures)


def test_a_printed_mean_has_the_interval_of_its_missions_and_our_spread(studies, rows):
    """By hand: a ratio of spread 0.14 and 901 successes in 1000 missions."""
    found = paper.intervals_of_means(paper.TABLE_IV, 1000, 0.14**2)
    halves = {metric: 100 * (ends.high - ends.mean) for metric, ends in found.items()}
    assert halves["collection_ratio"] == pytest.approx(196.2 * 0.14 / np.sqrt(1000), rel=1e-3)
    values = np.where(np.arange(10_000) < 9010, 0.798, 0.0)
    values[:9010] += 0.14 * np.resize([-1, 1], 9010)
    assert halves[PRODUCT] == pytest.approx(196.2 * values.std() / np.sqrt(1000), rel=1e-3)
    assert halves[PRODUCT] == pytest.approx(1.7, abs=0.05)
    for name in ("table4", "sweet-spot"):
        means = paper.printed_intervals(studies[name], name)
        of_study = [row for row in rows if row.claim.study == name and row.claim.printed_metric]
        assert len(of_study) == 3
        for row in of_study:
            assert row.claim.printed.interval == means[row.claim.printed_metric]
    texts = paper.best_settings_table(studies["sweet-spot"]).iloc[0]
    assert texts["Collection ratio"].startswith("93.6 % [")


def test_studies_of_another_kind_never_break_it(studied, tmp_path):
    """One number of UAVs, two fields at a time, a single mission."""
    designs = {"fig4": grid(uavs=[2], flying_time=[70, 80]), "fig5": grid(uavs=[2])}
    changes = {"policies": ["ddqn"], "missions": 1, "logged": 1}
    others = {
        name: run_study(load_study(name, design=design, **changes), tmp_path / name)
        for name, design in designs.items()
    }
    judged = scorecard(others, NONE)
    assert learned(judged, "dramatically").verdict == NO_RESULTS
    assert learned(judged, "best, and the sweet spot").verdict == NO_RESULTS
    assert learned(judged, "two sectors").verdict in VERDICTS
    small = studied(policies=["greedy"])
    assert all(row.findings[0].verdict == NO_RESULTS for row in scorecard({"fig4": small}, NONE))
