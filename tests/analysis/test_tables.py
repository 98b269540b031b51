"""Tables of text that the page of a study and the terminal share."""

import pandas as pd

from dess.analysis import numbers, tables
from dess.analysis.metrics import METRICS, PRODUCT


def test_a_comparison_has_marks_and_a_learner_the_interval_of_one_new_training():
    rows = [
        ("ours", "theirs", "success", 0.02, 0.2, 1),
        ("ours", "theirs", PRODUCT, -0.04, 0.0, 1),
        ("more", "theirs", "success", 0.03, 0.001, 3),
        ("more", "theirs", PRODUCT, 0.02, 0.001, 3),
    ]
    columns = ["learner", "baseline", "metric", "difference", "p_adjusted", "trainings"]
    frame = pd.DataFrame(rows, columns=columns)
    for end, room in (("low", -0.01), ("high", 0.01), ("new_low", -0.05), ("new_high", 0.05)):
        frame[end] = frame["difference"] + room
    shown = tables.compared(frame, "learner")
    names = [METRICS["success"], METRICS[PRODUCT]]
    more = ["One new training", "Trainings", "p of the product"]
    assert shown.columns.tolist() == ["Learner", *names, *more]
    assert shown.to_numpy().tolist() == [
        ["ours", "+2.0 [+1.0, +3.0] ≈", "−4.0 [−5.0, −3.0] ▼", "unknown", 1, "< 0.001"],
        ["more", "+3.0 [+2.0, +4.0] ▲", "+2.0 [+1.0, +3.0] ▲", "[−3.0, +7.0]", 3, "0.001"],
    ]
    of_policies = frame.drop(columns=["trainings", "new_low", "new_high"])
    assert [*tables.compared(of_policies, "learner")] == ["Learner", *names, more[-1]]


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
