"""``dess study show``: rows with their design, as JSON and CSV; targets, and the best policies."""

import io
import re

import pandas as pd
import pytest

from dess.analysis import load_results, load_study, run_study

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


def test_an_interrupted_study_shows_what_is_there(dess, dess_json, tmp_path):
    """Of every setting the missions up to the first one that is missing."""
    text = (tmp_path / "trial.toml").read_text()
    design = "kind = 'grid'\nvalues.uavs = [1, 2]\n"
    (tmp_path / "grid.toml").write_text(f"{text}\n[design]\n{design}")
    study = load_study(tmp_path / "grid.toml")
    done = []

    def interrupt(missions):
        done.append(missions)
        if sum(done) > 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "out", progress=interrupt)
    code, out, err = dess("study", "show", "out")
    assert code == 0 and "out: incomplete, so these are means of what is there" in err
    assert "which is incomplete" in out and "greedy" in out
    data = dess_json("study", "show", "out")
    assert data["complete"] is False
    assert 0 < sum(row["n"] for row in data["means"] if row["metric"] == "success") < 40
    run_study(study, tmp_path / "out")
    whole = load_results(tmp_path / "out").missions
    for row in data["means"]:
        values = whole.query("policy == @row['policy'] and point == @row['point']")[row["metric"]]
        assert row["mean"] == pytest.approx(values[: row["n"]].mean())
    assert "incomplete" not in dess("study", "show", "out")[2]


def test_design_points_are_compared_on_the_same_missions(shown, dess_json, refusal):
    data = dess_json("study", "show", "out", "--compare", 1)
    rows = pd.DataFrame(data["compared"]).query("metric == 'collection_ratio'")
    assert len(rows) == 2 * 3 and data["baseline"] == 1
    missions = load_results("out").missions
    for row in rows.itertuples():
        of_policy = missions[missions["policy"] == row.policy]
        means = of_policy.groupby("point")["collection_ratio"].mean()
        assert row.difference == pytest.approx(means[row.point] - means[1])
    text = shown("study", "show", "out", "--compare", 1)[1]
    assert text.startswith("against 1 UAV") and "paired difference from the baseline" in text
    csv = pd.read_csv(io.StringIO(shown("study", "show", "out", "--compare", 1, "--csv")[1]))
    assert len(csv) == len(data["compared"])
    assert "4 is not a design point; allowed: 0..3" in refusal(
        "study", "show", "out", "--compare", 4
    )


def test_missions_as_csv_have_their_design_point_and_every_varied_field(shown, refusal):
    table = pd.read_csv(io.StringIO(shown("study", "show", "out", "--missions")[1]))
    missions = load_results("out").missions
    assert len(table) == 80 and table["point"].tolist() == missions["point"].tolist()
    assert table["collection_ratio"].to_numpy() == pytest.approx(missions["collection_ratio"])
    values = table.groupby("point")[FIELDS].first()
    assert values["uavs"].tolist() == [1, 1, 2, 2]
    assert values["initial_data"].tolist() == ["5", "[5, 9.5]"] * 2
    assert "given together" in refusal("study", "show", "out", "--missions", "--json")
