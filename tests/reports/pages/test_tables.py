"""Tables on pages: every head stands over its columns."""

import re

import pandas as pd

from dess.reports.pages.tables import make_table

_CELL = re.compile(r"<(th|td)([^>]*)>(.*?)</\1>")


def heads_over(row: str) -> list[str]:
    """The head over each column, of a row of heads."""
    cells = _CELL.findall(row)
    spans = [int((re.findall(r'colspan="(\d+)"', look) or ["1"])[0]) for _, look, _ in cells]
    return [text for (*_, text), span in zip(cells, spans, strict=True) for _ in range(span)]


def test_the_head_of_a_group_stands_over_its_columns():
    """Also beside columns that belong to no group."""
    columns = [("", "Mission"), ("", "Points"), ("ddqn", "Success"), ("ddqn", "Collected")]
    frame = pd.DataFrame([["7", "−3", "yes", "91.0 %"]], columns=pd.MultiIndex.from_tuples(columns))
    heads = re.findall(r"<tr[^>]*>(.*?)</tr>", make_table(frame).data.partition("<tbody>")[0], re.S)
    assert [heads_over(row.replace("\n", "")) for row in heads] == [
        ["", "", "ddqn", "ddqn"],
        ["Mission", "Points", "Success", "Collected"],
    ]


def test_nan_is_explained_only_where_it_is_shown():
    """A cell without a value is empty."""
    without = make_table(pd.DataFrame({"p": [None, 0.5]}), "P-values").data
    assert "nan" not in without
    assert "nan: the missions are too few" in make_table(pd.DataFrame({"p": ["nan"]}), "P").data


def test_the_caption_stands_outside_of_what_scrolls():
    """Otherwise the caption of a wide table scrolls away with it."""
    shown = make_table(pd.DataFrame({"n": [1]}), "Missions at C_S").data
    above, _, inside = shown.partition('<div class="scroll"')
    assert above == '<p class="caption">Missions at C<sub>S</sub></p>'
    assert "caption" not in inside
    assert '<table aria-label="Missions at C_S"' in inside
