"""``dess study show``: rows with their design, as JSON and CSV; targets, and the best policies."""

import io
import re

import pandas as pd
import pytest

FIELDS = ["uavs", "initial_data"]


@pytest.fixture
def shown(dess, tmp_path):
    """The command, after a study of four design points and two policies has been run."""
    text = (tmp_path / "trial.toml").read_text()
    design = "kind = 'grid'\nvalues.uavs = [1, 2]\nvalues.initial_data = [5, [5, 9.5]]\n"
    (tmp_path / "grid.toml").write_text(f"{text}\n[design]\n{design}")
    assert dess("study", "run", "grid.toml", "--out", "out")[0] == 0
    return dess


def test_rows_carry_the_values_of_their_point(shown, dess_json):
    data = dess_json("study", "show", "out")
    values = [(uavs, initial) for uavs in (1, 2) for initial in (5, [5, 9.5])]
    for table in ("means", "worst"):
        assert data[table]
        for row in data[table]:
            assert (row["uavs"], row["initial_data"]) == values[row["point"]]
    # Which are over all design points.
    assert not {*FIELDS} & {*data["comparisons"][0]}


def test_csv_has_the_means_of_the_json(shown, dess_json):
    code, out, _ = shown("study", "show", "out", "--csv")
    table = pd.read_csv(io.StringIO(out))
    assert code == 0
    assert list(table)[:5] == ["policy", "point", *FIELDS, "metric"]
    means = pd.DataFrame(dess_json("study", "show", "out")["means"])
    for name in ("policy", "point", "uavs", "metric", "n", "verdict"):
        assert table[name].tolist() == means[name].tolist()
    assert table["mean"].to_numpy() == pytest.approx(means["mean"].to_numpy(), abs=1e-9)
    assert {*table["initial_data"]} == {"5", "[5, 9.5]"}


def test_targets_leave_what_meets_them_by_the_lower_end(shown, dess_json):
    rows = pd.DataFrame(dess_json("study", "show", "out")["means"]).set_index("metric")
    least = float(rows.loc["collection_ratio", "low"].median())
    passed = rows.loc["collection_ratio"].query("low >= @least")[["policy", "point"]]
    assert 0 < len(passed) < 8
    asked = ("study", "show", "out", "--target", f"ratio={least}", "--target", "success=0")
    data = dess_json(*asked)
    assert data["targets"] == {"collection_ratio": least, "success": 0.0}
    left = pd.DataFrame(data["means"])[["policy", "point"]].drop_duplicates()
    assert left.to_numpy().tolist() == passed.to_numpy().tolist()
    csv = pd.read_csv(io.StringIO(shown(*asked, "--csv")[1]))
    assert csv[["policy", "point"]].drop_duplicates().to_numpy().tolist() == left.values.tolist()
    text = shown(*asked)[1]
    assert text.startswith(
        f"{len(passed)} of 8 settings meet collection ratio of {least:g} or more"
    )
    listed = re.findall(r"^(?:greedy|random) with \d UAVs?, [^%]*?  ", text, re.M)
    assert len({*listed}) == len(passed)


# Options, and what the line on stderr must name.
BAD = {
    "--target succes=0.9": "--target: 'succes' is unknown (did you mean success?)",
    "--target success=99": "--target: success: 99 is not a share; allowed: 0..1",
    "--target ratio=0.5 --target collection_ratio=1": "collection_ratio is given twice",
    "--policy tour": "--policy: 'tour' is not in the study",
}


def test_bad_options_get_one_line(dess, refusal):
    assert dess("study", "run", "trial.toml", "--missions", 2, "--out", "out")[0] == 0
    for options, words in BAD.items():
        assert words in refusal("study", "show", "out", *options.split())
