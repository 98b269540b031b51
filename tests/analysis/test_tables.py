"""Tables of text: a cell for every estimate, and no row without one."""

import numpy as np
import pandas as pd

from dess.analysis import tables

RATE = "failures.uav_rate"


def test_what_was_never_measured_makes_no_row():
    """Where nothing can fail, the number of failures is not measured: it has no missions."""
    rows = [(3, 0.0, np.nan, 0), (3, 0.01, 2.0, 400), (6, 0.0, 1.0, 400)]
    estimates = pd.DataFrame(rows, columns=["uavs", RATE, "mean", "n"])
    estimates = estimates.assign(low=estimates["mean"], high=estimates["mean"])
    table = tables.estimate_cells(estimates, ["uavs", "n"], RATE, lambda mean, *_: f"{mean:g}")
    assert table["Missions"].tolist() == ["400", "400"]
    assert [*table.columns[2:]] == ["0", "0.01"]
    assert table.iloc[:, 2:].to_numpy().tolist() == [["", "2"], ["1", ""]]
