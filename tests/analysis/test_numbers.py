"""How numbers are written."""

import pandas as pd
import pytest

from dess.analysis import numbers


def test_shares_are_in_percent_with_a_proper_minus():
    assert numbers.format_percent(0.97312) == "97.3 %"
    assert numbers.format_interval(0.5, -0.012, 1) == "50.0 % [−1.2, 100.0]"
    assert numbers.format_percent(-0.0001) == "0.0 %"  # no minus on zero


def test_differences_are_in_points_with_a_sign():
    assert numbers.format_difference(0.5, 0.426) == "+7.4"
    assert numbers.format_difference(0.5, 0.521) == "−2.1"
    assert numbers.format_difference(0.5, 0.50001) == "0.0"
    assert numbers.format_points(0.01, -0.002, 0.0222) == "+1.0 [−0.2, +2.2]"


def test_what_rounding_leaves_of_0_is_0():
    assert numbers.format_quantities(0.1 + 0.2 - 0.3, -(2.0**-52), 0.0) == "0 [0, 0]"
    assert numbers.format_quantity(-1e-9) == "−1e−09"


@pytest.mark.parametrize(
    ("values", "text"), [([300, 300], "300"), ([1200, 20, 300], "20 to 1,200"), ([7], "7")]
)
def test_a_span_is_one_number_where_all_are_alike(values, text):
    assert numbers.format_span(values) == text


def test_a_wide_table_keeps_the_order_of_appearance():
    rows = [("tour", 2, "z", 0.2), ("tour", 2, "a", 0.3), ("greedy", 1, "z", 0.4)]
    table = pd.DataFrame(rows, columns=["policy", "uavs", "metric", "mean"])
    estimates = table.assign(low=table["mean"], high=table["mean"])
    wide = numbers.estimates_as_text(
        estimates, ["policy", "uavs"], write=lambda mean, low, high: f"{mean:g}"
    )
    assert wide.index.tolist() == [("tour", 2), ("greedy", 1)]
    assert wide.columns.tolist() == ["z", "a"]
    assert wide["z"].tolist() == ["0.2", "0.4"]
    assert wide.columns.name is None


@pytest.mark.parametrize(
    ("time", "text"),
    [(2.0, "2 s"), (0.0123456, "12.3 ms"), (3.1e-6, "3.1 µs"), (4.78e-7, "478 ns"), (1e-3, "1 ms")],
)
def test_a_time_has_three_digits_in_its_unit(time, text):
    assert numbers.format_seconds(time) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 seconds"), (119, "119 seconds"), (120, "2 minutes"), (7200, "2 hours")]
    + [(86400 * 1234, "1,234 days")],
)
def test_a_duration_has_one_unit(seconds, text):
    assert numbers.format_duration(seconds) == text


@pytest.mark.parametrize(
    ("number", "what", "text"),
    [(1, "mission", "1 mission"), (0, "pad", "0 pads"), (3000, "policy", "3,000 policies")],
)
def test_one_thing_is_in_the_singular(number, what, text):
    assert numbers.format_count(number, what) == text
