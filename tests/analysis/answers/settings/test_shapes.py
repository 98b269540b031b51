"""The shape of a metric along a field: its values are compared on the same missions."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis.answers.policies.ranks import leading_policies
from dess.analysis.answers.settings import effects, shapes
from dess.analysis.answers.settings.shapes import FALLS, IRREGULAR, LEVELS, PEAK, RISES, VALLEY
from dess.analysis.answers.summary import means_of_points
from dess.analysis.metrics import PRODUCT, SUCCESS
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.weights import by_replication
from tests.analysis.small import grid


@pytest.fixture(scope="module")
def results(studied):
    values = {"uavs": [1, 2], "initial_data": [[5, 7.5], 10, [2, 20]]}
    design = {"kind": "one-at-a-time", "values": values}
    return studied(design=design, missions=20)


def pairs_of(steps, sure=True, half=0.001, widened=2):
    """All pairs of values with these steps between neighbours, all of them sure, or none."""
    level = np.concatenate([[0.0], np.cumsum(steps)])
    rows = [
        (i, j, level[j] - level[i]) for i in range(len(level)) for j in range(i + 1, len(level))
    ]
    table = pd.DataFrame(rows, columns=["first", "second", "difference"])
    p = np.where(sure & (table["difference"].abs() > half), 0.001, 1.0)
    gap = table["difference"]
    wide = widened * half
    ends = {"low": gap - half, "high": gap + half, "wide_low": gap - wide, "wide_high": gap + wide}
    return table.assign(**ends, p_adjusted=p)


def test_success_is_compared_where_the_number_of_uavs_is_drawn(results):
    """Its post-stratified values lie outside [0, 1]."""
    missions = results.missions.assign(success=results.missions["replication"] % 2)
    found = replace(results, missions=missions)
    pairs = shapes.compare_values(found, "random", "initial_data", SUCCESS)
    assert (pairs["difference"] == 0).all() and (pairs["low"] < 0).all()


def test_a_field_has_the_means_of_the_points_that_set_it(results):
    """Not those of points that set another field, at which it is as in the scenario."""
    table = effects.means_by_field(results)
    means = means_of_points(results).set_index(["policy", "point", "metric"])
    of_points = {"uavs": [0, 1], "initial_data": [2, 3, 4]}
    assert table.groupby("field")["position"].max().to_dict() == {"uavs": 1, "initial_data": 2}
    for row in table.itertuples():
        expected = means.loc[(row.policy, of_points[row.field][row.position], row.metric)]
        assert (row.mean, row.low, row.high, row.n) == pytest.approx(tuple(expected))
    rows = table[table["field"] == "initial_data"]
    assert [*rows["value"].unique()] == ["5–7.5", "10", "2–20"]


def test_a_design_of_several_fields_is_refused(studied):
    several = studied(design=grid(uavs=[1, 2], quota=[20, 30]), missions=2)
    with pytest.raises(InputError, match="point 0: sets uavs, quota"):
        effects.means_by_field(several)


@pytest.mark.parametrize(
    ("steps", "words", "peaks"),
    [
        ([0, 0, 0], LEVELS, (0, 1, 2, 3)),
        ([1, 0, 1], RISES, (3,)),
        ([1, 0, 0], RISES, (1, 2, 3)),
        ([0, -1, -1], FALLS, (0, 1)),
        ([1, 1, -1], PEAK, (2,)),
        ([1, 0, -1], PEAK, (1, 2)),
        ([-1, -1, 1], VALLEY, ()),
        ([1, -1, 1], IRREGULAR, ()),
    ],
)
def test_shapes(steps, words, peaks):
    assert shapes.shape_of_changes(pairs_of(steps)) == shapes.Shape(words, peaks)
    assert shapes.shape_of_changes(pairs_of(steps, sure=False)).words == LEVELS


def test_the_best_policies_are_shown_unless_others_are_asked_for(results):
    means = results.missions.groupby("policy")[PRODUCT].mean()
    assert leading_policies(results) == [means.idxmax()]
    named = leading_policies(results, means.idxmax(), means.idxmin())
    assert named == [means.idxmax(), means.idxmin()]
    with pytest.raises(InputError, match="policy: 'learned' is not in the study"):
        leading_policies(results, "learned", means.idxmin())


def test_changes_are_paired_by_replication(results):
    """Intervals that hold for all three pairs at once are wider, by Bonferroni."""
    pairs = shapes.compare_values(results, "greedy", "initial_data", "collection_ratio")
    assert pairs[["first", "second"]].to_numpy().tolist() == [[0, 1], [0, 2], [1, 2]]
    missions = results.missions.query("policy == 'greedy'")
    values = by_replication(missions, "collection_ratio", "point")
    wide = compare_pairs(
        values[4].to_numpy(), values[3].to_numpy(), 1 - 0.05 / 3, "collection_ratio"
    )
    columns = ["difference", "wide_low", "wide_high"]
    assert pairs.loc[2, columns].tolist() == pytest.approx([*wide[:3]])
    assert pairs["p_adjusted"].tolist() == adjust_p_values(pairs["p"].to_numpy(), "holm").tolist()


def test_the_answer_says_of_every_policy_where_a_parameter_leads():
    """A large quota may hurt one policy and help another one."""
    means = {"learned": (0.9, 0.785), "greedy": (0.6, 0.69)}
    table = pd.DataFrame(
        {"field": "quota", "position": position, "value": value, "policy": policy,
         "metric": PRODUCT, "mean": of_policy[position], "n": 300}
        for policy, of_policy in means.items()
        for position, value in enumerate(("440", "600"))
    )  # fmt: skip
    pair = {"first": [0], "second": [1], "difference": [0.1]}
    changes = {
        "quota": {
            "learned": pd.DataFrame({**pair, "p_adjusted": [0.01]}),
            "greedy": pd.DataFrame({**pair, "p_adjusted": [0.2]}),
        }
    }
    said = shapes.strongest_fields_sentence(table, ["learned", "greedy"], changes)
    assert (
        "of learned depends most on the communication quota (from 90.0 % at 440 to 78.5 % at 600)."
        in said
    )
    assert (
        "of greedy depends most on the communication quota (from 60.0 % at 440 to 69.0 % at 600, "
        "inconclusive)." in said
    )
    assert said.endswith("n = 300 missions per value.")
