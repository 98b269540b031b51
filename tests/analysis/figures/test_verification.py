"""What the figures of the verification show is in what they are given."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from dess import load_scenario
from dess.analysis.verification import closed_forms, measurements
from dess.analysis.verification import figures as drawings
from dess.analysis.verification.checks import Fit
from dess.analysis.verification.figures import MISS, SEEN

SPACE = load_scenario("paper")
TABLE = pd.DataFrame(
    {"label": ["0", "1", "2 or more"], "observed": [901, 94, 5], "expected": [900.0, 80.0, 20.0]}
)


def dots(figure: Figure, panel: int, colour: str | None = None) -> np.ndarray:
    """(N, 2) the dots of a panel, of all colours or of one."""
    return np.concatenate(
        [
            np.asarray(group.get_offsets())
            for group in figure.axes[panel].collections
            if hasattr(group, "get_sizes")
            and len(group.get_sizes())
            and (colour is None or to_hex(group.get_facecolor()[0]) == colour)
        ]
    )


def test_a_fit_shows_both_numbers_and_marks_differences_that_are_far_off() -> None:
    figure = drawings.fit(Fit(TABLE, 0.1), "Title", "units")
    bars = [bar.get_height() for bar in figure.axes[0].patches]
    assert bars == TABLE["expected"].tolist()
    assert dots(figure, 0)[:, 1].tolist() == TABLE["observed"].tolist()
    share = TABLE["expected"] / 1000
    z = (TABLE["observed"] - TABLE["expected"]) / np.sqrt(1000 * share * (1 - share))
    assert sorted(dots(figure, 1)[:, 1]) == pytest.approx(sorted(z))
    labels = [label.get_text() for label in figure.axes[1].get_xticklabels()]
    assert labels == ["0", "1", "2\nor more"]
    # Classes that are far off are marked.
    assert dots(figure, 1, MISS)[:, 0].tolist() == [2]
    assert dots(figure, 1, SEEN)[:, 0].tolist() == [0, 1]
    low, high = figure.axes[1].get_ylim()
    assert low < min(z) and high > max(z)


def test_rates_stand_beside_their_curve() -> None:
    table = measurements.rates(SPACE, measurements.simulate_rates(SPACE, 3))
    figure = drawings.rates(table, SPACE)
    assert dots(figure, 0) == pytest.approx(table[["distance", "mean"]].to_numpy())
    (curve,) = figure.axes[0].lines
    ends = [closed_forms.rate_moments(SPACE, d).mean for d in curve.get_xdata()[[0, -1]]]
    assert curve.get_ydata()[[0, -1]] == pytest.approx(ends)
    z = (table["mean"] - table["known"]) / table["error"]
    assert sorted(dots(figure, 1)[:, 1]) == pytest.approx(sorted(z))
