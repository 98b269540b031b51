"""The page of the comparison says what its missions say, and takes no times of its own."""

import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from scipy import stats

from analysis import load_results, load_study, numbers, run_study
from analysis.answers import comparison, summary
from analysis.answers.missions import FOLDER
from analysis.stats.differences import paired
from analysis.stats.intervals import by_replication
from dess import InputError
from reports.pages import kernels
from tests.reports.small import said_by, shown_by

NAME = "comparison"
POLICIES = ["random", "greedy", "nearest", "ddqn"]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    study = run_study(load_study(NAME, policies=POLICIES, missions=120), folder / NAME)
    comparison.make(folder, study)
    return folder


def said(results: Path, **parameters: str) -> str:
    return said_by(NAME, results=str(results), **parameters)


@pytest.fixture(scope="module")
def text(results: Path) -> str:
    return said(results)


def with_studies_of(folder: Path, **changes: Any) -> Path:
    """Results of other missions."""
    comparison.make(folder, run_study(load_study(NAME, **changes), folder / NAME))
    return folder


def test_the_difference_is_computed_anew_from_the_files(text: str, results: Path) -> None:
    """Its post-stratified mean with its interval, and the share of lost missions with Wilson's."""
    product = "collection_ratio_and_communication"
    missions = pd.read_parquet(results / NAME / "missions").astype({"policy": str})
    table = missions.pivot(index="replication", columns="policy", values=product)
    values = by_replication(missions, product, "policy")
    baseline = values.drop(columns="ddqn").mean().idxmax()
    assert f"The product of ddqn minus that of {baseline} is" in text
    assert f"on average over {len(table)} missions" in text
    pair = paired(values["ddqn"].to_numpy(), values[baseline].to_numpy(), metric=product)
    points = [pair.difference, pair.low, pair.high]
    mean, low, high = (f"{100 * value:+.1f}".replace("-", "−") for value in points)
    assert f"{mean} [{low}, {high}]" in text
    lost = int((table["ddqn"] < table[baseline]).sum())
    ends = stats.binomtest(lost, len(table)).proportion_ci(0.95, "wilson")
    share = f"{lost / len(table):.1%} [{100 * ends.low:.1f}, {100 * ends.high:.1f}]"
    assert f"ddqn behind {lost} {share.replace('%', ' %')}" in text


def test_the_page_says_what_the_missions_say(text: str, results: Path) -> None:
    study = load_results(results / NAME)
    pair = comparison.pair_of(study)
    assert (pair.policy, pair.candidates) == ("ddqn", 3)
    for table in (summary.learned_against_heuristic(study), summary.comparisons(study)):
        for _, row in table.iterrows():
            assert numbers.points(row["difference"], row["low"], row["high"]) in text
    missions = comparison.duels(study, pair)
    lead = comparison.along(missions, pair.candidates)
    for row in lead.itertuples():
        assert f"n = {numbers.span(lead[lead['field'] == row.field]['n'])} missions per dot" in text


def test_the_worst_missions_are_drawn_by_both_policies(results: Path, tmp_path: Path) -> None:
    """Captions have the numbers of the files; pages have the maps of missions that are kept."""
    assert "a single one (n = 1)" not in said(results)
    (tmp_path / NAME).symlink_to(results / NAME)
    for chosen in ({}, {"learned": "random", "heuristic": "nearest"}):
        kernels.make([NAME, "learning"], tmp_path, chosen)
        shown = shown_by(NAME, results=str(tmp_path), **chosen)
        assert shown.count('alt="Map of mission ') == 4
    assert len([*(tmp_path / FOLDER).glob("*.parquet")]) == 8
    columns = ["policy", "replication", "collected", "initial", "arrived", "slots"]
    records = pd.read_parquet(results / NAME / "missions").astype({"policy": str})
    product = ["collection_ratio_and_communication", "collection_ratio"]
    of_random = records[records["policy"] == "random"].sort_values([*product, "replication"])
    worst = of_random["replication"].head(2)
    drawn = records[records["policy"].isin(["random", "nearest"])]
    for row in drawn.loc[drawn["replication"].isin(worst), columns].itertuples():
        assert f"{row.policy} in mission {row.replication}, a single one (n = 1): " in shown
        total = row.initial + row.arrived
        assert f"{row.collected:.1f} of {total:.1f} data units collected in {row.slots} " in shown


def test_the_times_are_those_that_were_kept(text: str, results: Path) -> None:
    times = comparison.read(results, load_results(results / NAME))
    assert [cost.policy for cost in times.costs] == POLICIES
    for cost in times.costs:
        shown = f"{cost.policy} {numbers.seconds(cost.median)} {numbers.seconds(cost.slow)}"
        assert f"{shown} {cost.calls:,}" in text
    assert times.processor in text


def test_policies_can_be_chosen(results: Path) -> None:
    text = said(results, learned="random", heuristic="nearest")
    assert "The product of random minus that of nearest" in text
    # success, then collection ratio
    assert re.search(r"ahead of nearest in .*?inconclusive[^▲▼≈]*random [^▲▼≈]*[▲▼≈][^▲▼≈]*▼", text)
    with pytest.raises(InputError, match="learned: 'none' is not in the study; allowed: "):
        said(results, learned="none")


def test_several_trainings_are_one_learner_and_the_first_is_shown(
    results: Path, tmp_path: Path
) -> None:
    folder = with_studies_of(
        tmp_path / "results", policies=["greedy", "ddqn", "ddqn-2"], missions=60
    )
    text = said(folder)
    assert "The product of ddqn minus that of greedy" in text
    assert "every learner and the best heuristic" in text
    assert re.search(r"Trainings p of the product ddqn [^▲▼≈]*([▲▼≈][^▲▼≈]*){3} 2 ", text)
    for team in load_results(folder / NAME).store.manifest.policies:
        for member in team.members:
            assert not member.weights or f"{team.policy} {member.weights[:12]}" in text
