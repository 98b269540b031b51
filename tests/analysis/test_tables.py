"""Tables of text that the page of a study and the terminal share."""

import pandas as pd

from dess.analysis import numbers, tables


def test_estimates_have_a_row_per_setting_and_nothing_where_nothing_is_known():
    rows = [("mine", 3000 + uavs, uavs, pads, 10.0 * pads) for uavs in (2, 4) for pads in (1, 2)]
    table = pd.DataFrame(rows, columns=["policy", "n", "uavs", "pads", "mean"])
    table["low"] = table["high"] = table["mean"] = table["mean"].where(table["pads"] != 2)
    shown = tables.estimates(table, ["policy", "uavs", "n"], "pads", numbers.quantities)
    assert shown.columns.tolist() == ["Policy", "Number of UAVs", "Missions", "1", "2"]
    assert shown.to_numpy().tolist() == [
        ["mine", "2", "3,002", "10 [10, 10]", ""],
        ["mine", "4", "3,004", "10 [10, 10]", ""],
    ]
