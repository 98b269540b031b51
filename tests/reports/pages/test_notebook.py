"""The cell of a notebook's parameters: read, and written with other values."""

import os
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.reports.pages.notebook import assigned_values, replace_paths, replace_values

CELL = """results = "../../results"  # the folder
settings = {
    "uavs": 5,  # of them
}  # what is set
# A comment — of its own
missions = 500  # of every policy
name = "é"; shown = None
"""
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.text()
    | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)


def test_the_values_of_a_cell_are_read():
    assert assigned_values(CELL) == {
        **{"results": "../../results", "settings": {"uavs": 5}, "missions": 500},
        **{"name": "é", "shown": None},
    }


def test_other_values_leave_comments_and_other_lines_as_they_are():
    written = replace_values(CELL, {"settings": {"pads": 2}, "shown": "tour", "unknown": 1})
    assert written == CELL.replace(
        """{
    "uavs": 5,  # of them
}""",
        "{'pads': 2}",
    ).replace("None", "'tour'")
    assert replace_values(CELL, assigned_values(CELL)) == CELL


@given(st.fixed_dictionaries({}, optional=dict.fromkeys(assigned_values(CELL), PLAIN)))
def test_what_is_written_is_read(values):
    written = replace_values(CELL, values)
    assert assigned_values(written) == assigned_values(CELL) | values
    assert written.count("#") >= 4 and "# A comment — of its own" in written


@pytest.mark.parametrize(
    ("value", "moved"),
    [
        ("greedy,./mine", f"greedy,{os.path.abspath('mine')}"),
        (["sea.toml", "paper", 3], [os.path.abspath("sea.toml"), "paper", 3]),
        ({"uavs": 3}, {"uavs": 3}),
    ],
)
def test_paths_are_written_another_way_and_words_are_not(value, moved):
    assert replace_paths(value, os.path.abspath) == moved
    relative = partial(os.path.relpath, start=os.getcwd())
    assert replace_paths(moved, relative) == replace_paths(value, os.path.normpath)


def test_policies_of_the_working_folder_are_paths(tmp_path, monkeypatch):
    """A notebook runs in another folder; the folder of a trained policy may be named without ./."""
    monkeypatch.chdir(tmp_path)
    Path("mine").mkdir()
    Path("mine/config.json").write_text("{}")
    moved = replace_paths(["mine", "greedy,mine", "own.py:Own", "others"], os.path.abspath)
    assert moved == [
        f"{tmp_path}/mine",
        f"greedy,{tmp_path}/mine",
        f"{tmp_path}/own.py:Own",
        "others",
    ]
