"""The sweet spot beside the paper is what the check found."""

import pandas as pd
import pytest

from analysis import numbers, run_study
from analysis.names import METRICS, PRODUCT
from analysis.questions.main_effects import ByField
from analysis.replication import sweet_spot
from analysis.results.tables import Results
from analysis.stats.intervals import bounded_interval
from tests.analysis.small import grid, small_study

RULE = {"procedure": "kn-bounded", "first": 4, "indifference": 0.01, "budget": 60, "check": 12}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("study")
    design = grid(uavs=[1, 3], initial_data=[[5, 7.5], 10])
    return run_study(small_study(folder, design=design, selection=RULE), folder / "out")


def test_the_paper_is_the_first_row_and_policies_follow(results: Results) -> None:
    table = sweet_spot.table(results).set_index("Policy")
    assert table.index.tolist() == ["paper", "greedy", "random"]
    assert table.loc["paper", METRICS[PRODUCT]] == "93.0 %"
    for policy in results.policies:
        checks = results.checks.query("policy == @policy")
        mean, low, high = bounded_interval(checks[PRODUCT])
        cell = table.loc[policy, METRICS[PRODUCT]]
        assert cell.startswith(f"{100 * mean:.1f} % [{100 * low:.1f}, {100 * high:.1f}]")
        assert cell[-1] == ("▲" if low > 0.93 else "▼" if high < 0.93 else "≈")
        assert table.loc[policy, "Initial data"] in ("5–7.5", "10")
        (point,) = checks["point"].unique()
        assert table.loc[policy, "UAVs"] == ("1", "1", "3", "3")[point]


def one_by_one(uavs: tuple[str, str], sign: float) -> tuple[pd.DataFrame, ByField]:
    """Main effects of the number of UAVs: the second value is higher, or lower, than the first."""
    effects = pd.DataFrame({"field": "uavs", "position": [0, 1], "value": [*uavs]})
    ends = {"difference": sign * 0.2, "low": sign * 0.2 - 0.1, "high": sign * 0.2 + 0.1}
    pairs = pd.DataFrame([{"first": 0, "second": 1, **ends, "p_adjusted": 0.001}])
    return effects, {"uavs": {"greedy": pairs}}


def test_a_selected_value_that_is_lower_by_its_main_effect_is_explained(results: Results) -> None:
    choice = results.choice("greedy")
    assert choice is not None
    best = results.store.manifest.points[choice.best].values
    chosen, other = best["uavs"], 4 - best["uavs"]  # of 1 and 3
    values = str(other), str(chosen)
    assert sweet_spot.against_main_effects(results, *one_by_one(values, 1.0)) == ""
    text = sweet_spot.against_main_effects(results, *one_by_one(values, -1.0))
    assert text.startswith(
        f"- **greedy, number of UAVs**: by the main effect, {chosen} is lower than {other} by "
        "+20.0 [+10.0, +30.0] points"
    )
    points = [point.values for point in results.store.manifest.points]
    there = [choice.best, points.index({**best, "uavs": other})]
    missions = results.missions.query("policy == 'greedy'")
    both = missions.pivot(index="replication", columns="point", values=PRODUCT)[there].dropna()
    gap = numbers.difference((both[there[0]] - both[there[1]]).mean(), 0)
    assert f"{chosen} minus {other} is {gap} [" in text and f"(n = {len(both)} missions" in text
    text = sweet_spot.against_main_effects(results, *one_by_one(("2", str(chosen)), -1.0))
    assert "has no setting with 2 and" in text


def test_every_selection_says_what_is_known_of_it(results: Results) -> None:
    lines = sweet_spot.guarantees(results).splitlines()
    assert [line.split("**")[1] for line in lines] == results.policies
