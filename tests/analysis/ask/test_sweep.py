from functools import partial

import numpy as np
import pytest
import tqdm.auto
from matplotlib.figure import Figure

from analysis import sweep
from analysis.metrics import PRODUCT
from dess import InputError
from tests.analysis.small import write_scenario

POLICIES = ["random", "greedy"]


@pytest.fixture
def asking(tmp_path):
    """Asks a sweep of the small scenario."""

    def run(missions=6, progress=False, **fields):
        return sweep(
            write_scenario(tmp_path), POLICIES, missions, 3, tmp_path, progress=progress, **fields
        )

    return run


def test_settings_are_ranked(asking):
    answer = asking(uavs=range(1, 3), quota=np.array([20, 40]), pads=2)
    assert answer.fields == ["uavs", "quota"]
    table = answer.table()
    assert len(table) == 2 * 2 * 2
    assert [*table["rank"]] == [*range(1, 9)]
    assert table[PRODUCT].is_monotonic_decreasing
    missions = answer.results.missions
    for row in table.itertuples():
        of_row = missions[(missions["policy"] == row.policy) & (missions["point"] == row.point)]
        assert row.collection_ratio == pytest.approx(of_row["collection_ratio"].mean())
        assert {*of_row["uavs"]} == {row.uavs}
    best = answer.best()
    assert [*best["policy"]] == [*table["policy"].unique()]
    assert best["rank"].iloc[0] == 1
    best, other = answer.answers()
    assert best.startswith(f"The best setting is {table['policy'][0]} with ")
    found = table[table["policy"] != table["policy"][0]].iloc[0]
    assert other.startswith(f"With {found['policy']}, it would be {found['uavs']} UAV")
    assert answer.guarantee == ""


def test_the_cheapest_settings_are_the_best(tmp_path):
    about = {"missions": 5, "folder": tmp_path, "prices": {"uav": 7}, "progress": False}
    about["policies"] = ["greedy"]
    answer = sweep(
        write_scenario(tmp_path), requirements={"ratio": 0.1}, uavs=[1, 2], quota=[20, 40], **about
    )
    best = answer.best()
    assert [*best["uavs"]] == [1, 1]
    assert [*best["quota"]] == [20, 40]
    assert {*best["verdict"]} == {"met"}
    assert len(answer.answers()) == 3
    assert "with probability at least 0.95" in answer.guarantee
    assert len(answer.results.checks) == 2 * 5


def test_a_plot_is_over_the_first_fields(asking):
    answer = asking(missions=2, uavs=[1, 2], quota=[20, 40])
    assert isinstance(answer.plot(), Figure)
    assert answer.plot().axes[0].get_xlabel() == answer.plot("uavs", "quota").axes[0].get_xlabel()
    with pytest.raises(InputError, match="pads: has not several values"):
        answer.plot("pads")
    with pytest.raises(InputError, match="x: no field is swept"):
        asking(missions=2, uavs=1).plot()


def test_progress_counts_missions(asking, capsys, monkeypatch):
    done = []
    asking(progress=done.append, uavs=[1, 2])
    assert sum(done) == 2 * 2 * 6
    asking(progress=True, uavs=[1, 2])
    assert capsys.readouterr().err == ""  # nothing is simulated
    monkeypatch.setattr(tqdm.auto, "tqdm", partial(tqdm.auto.tqdm, disable=True))  # as on pages
    assert len(asking(progress=True, uavs=[1, 3]).results.missions) == 2 * 2 * 6


def test_the_best_setting_at_an_end_of_the_values_says_so(tmp_path):
    """More data can be collected by more UAVs; with one UAV nothing is left to leave out."""
    asked = {"scenario": write_scenario(tmp_path, quota=30), "policies": ["greedy"]}
    asked |= {"missions": 100, "folder": tmp_path / "results", "progress": False}
    (text,) = sweep(uavs=[1, 2], **asked).answers()
    assert text.endswith(
        "Of the values asked for, 2 UAVs is the largest; a better one may lie beyond."
    )
    assert sweep(uavs=[1, 6], **asked).answers() == []  # the zone has no more cells
