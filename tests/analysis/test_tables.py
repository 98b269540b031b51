"""Tables of text: a cell for every estimate, and no row without one."""

import numpy as np
import pandas as pd

from dess.analysis import tables


def test_what_was_never_measured_makes_no_row():
    """Where nothing can fail, the number of failures is not measured: it has no missions."""
    rows = pd.DataFrame(
        [
            ("greedy", 3, 0.0, np.nan, 0),
            ("greedy", 3, 0.01, 2.0, 400),
            ("greedy", 6, 0.0, 1.0, 400),
        ],
        columns=["uavs", "failures.uav_rate", "mean", "n"],
    )
    rows = rows.assign(policy="greedy", low=rows["mean"], high=rows["mean"])
    table = tables.estimates(
        rows, ["policy", "uavs", "n"], "failures.uav_rate", lambda mean, *_: f"{mean:g}"
    )
    assert table["Missions"].tolist() == ["400", "400"]
    assert [*table.columns[3:]] == ["0", "0.01"]
    assert table.iloc[:, 3:].to_numpy().tolist() == [["", "2"], ["1", ""]]
