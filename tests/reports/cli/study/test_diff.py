"""``dess study diff``: whether two results folders are identical, or which missions differ."""

import json
import re
import shlex
import shutil

from tests.analysis.hostile import forged
from tests.analysis.small import files_of


def test_a_folder_is_identical_with_itself(dess, dess_json, tmp_path):
    assert dess("study", "run", "trial.toml", "--out", "a")[0] == 0
    shutil.copytree("a", "b")
    before = files_of(tmp_path)
    assert dess("study", "diff", "a", "b") == (0, "identical: 20 missions\n", "")
    data = dess_json("study", "diff", "a", "b")
    assert data["identical"] is True
    assert (data["missions"], data["differ"], data["changed"], data["alone"]) == (20, 0, [], [])
    assert files_of(tmp_path) == before


def test_the_missions_that_differ_are_named_with_their_commands(dess, dess_json, tmp_path):
    assert dess("study", "run", "trial.toml", "--out", "a")[0] == 0
    shutil.copytree("a", "b")
    (path,) = (tmp_path / "b" / "missions" / "policy=random").glob("*.parquet")
    path = forged(path, "collection_ratio", lambda v: [*v[:6], v[6] + 0.125, *v[7:]])
    forged(path, "reward", lambda v: [*v[:2], v[2] + 3.0, *v[3:]])
    code, out, err = dess("study", "diff", "a", "b")
    assert (code, err) == (0, "")
    assert out.startswith("2 of 20 missions differ\n")
    assert re.search(r"random +2 of 10 +0.0 \[.*\] . +\+1.2 \[−22.5, \+24.8\]", out)
    assert " 1 more without any difference\n" in out
    data = dess_json("study", "diff", "a", "b")
    assert data["identical"] is False
    identity = {"policy_a": "random", "policy_b": "random", "point_a": 0, "point_b": 0}
    assert data["changed"] == [
        identity | {"replication": 6, "fields": "collection_ratio"},
        identity | {"replication": 2, "fields": "reward"},
    ]
    first = data["most_changed"][0]
    assert "random, replication 6: collection_ratio\n     A: dess simulate --of a" in out
    assert f"A: {first['command_a']}\n     B: {first['command_b']}\n" in out
    simulated = json.loads(dess(*shlex.split(first["command_a"])[1:], "--json")[1])
    assert simulated["replication"] == 6


def test_design_points_and_both_commands_are_shown(dess, tmp_path):
    """Of two policies that are compared whatever their names, each has its own command."""
    for policy in ("greedy", "random"):
        text = (tmp_path / "trial.toml").read_text()
        design = "\n[design]\nkind = 'grid'\nvalues.quota = [20, 60]\n"
        (tmp_path / "grid.toml").write_text(text + design)
        assert dess("study", "run", "grid.toml", "--policy", policy, "--out", policy)[0] == 0
    code, out, _ = dess("study", "diff", "greedy", "random", "--most", 1)
    assert code == 0
    assert re.search(r"\ngreedy with communication quota 20 +10 of 10 ", out)
    (of_a,) = re.findall(r"     A: dess simulate .*--policy greedy", out)
    (of_b,) = re.findall(r"     B: dess simulate .*--policy random", out)
    assert "2 more" not in out
