"""The sweet spot beside the paper is what the check found."""

import pytest

from analysis import run_study
from analysis.names import METRICS, PRODUCT
from analysis.paper import values
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
    table = values.table(results).set_index("Policy")
    assert table.index.tolist() == ["paper", "greedy", "random"]
    assert table.loc["paper", METRICS[PRODUCT]] == "93.0 %"
    for policy in results.policies:
        checks = results.checks.query("policy == @policy")
        mean, low, high = bounded_interval(checks[PRODUCT])
        cell = table.loc[policy, METRICS[PRODUCT]]
        assert cell.startswith(f"{100 * mean:.1f} % [{100 * low:.1f}, {100 * high:.1f}]")
        assert cell[-1] == ("▲" if low > 0.93 else "▼" if high < 0.93 else "≈")
        assert table.loc[policy, "Initial data"] in ("5–7.5", "10")
        assert table.loc[policy, "Guarantee"]
        (point,) = checks["point"].unique()
        assert table.loc[policy, "UAVs"] == ("1", "1", "3", "3")[point]
