"""Tables of text that the page of a study and the terminal share."""

import pandas as pd

from analysis.names import METRICS, PRODUCT
from reports import tables


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
