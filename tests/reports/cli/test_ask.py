"""``dess sweep`` and ``dess what-if``: from a line to an answer and its page."""

import json
import re
import shlex
from pathlib import Path

import pytest

from dess.analysis import load_results, load_study
from dess.analysis.ask.question import Question
from dess.analysis.execution import runner, workers
from tests.analysis.small import files_of

ASKED = ["sweep", "--scenario", "small.toml", "--missions", 6, "--policy", "greedy,random"]
FIELDS = ["--set", "uavs=1..2", "--set", "quota=20,40"]


WHAT_IF = ["what-if", "--scenario", "small.toml", "--missions", 6, "--set", "uavs=2"]
WHAT_IF += ["--baseline", "uavs=1", "--policy", "greedy", "--policy", "random"]


def test_a_line_leads_to_a_page(dess, unrendered, tmp_path):
    prices = ["--price", "uav=20000", "--price", "currency=USD"]
    code, out, err = dess(*ASKED, *FIELDS, *prices)
    assert code == 0
    assert "48 missions" in err
    name = re.search(r"sweeps/(uavs-quota-[0-9a-f]{16})\.toml", out)[1]
    assert len(load_results(tmp_path / "results" / "sweeps" / name).missions) == 48
    assert re.search(r"Rank +Policy +Point +uavs +quota +product +success\n", out)
    assert re.search(r"1 +≈ +(greedy|random) +[0-3] +[12] +(20|40)", out)
    assert re.search(r"[24]0,000 USD", out)
    assert "8 settings" in out
    assert re.search(r"prices +a UAV 20,000 USD\n", out)
    assert f"page: build/reports/study-{name}.html\n" in out
    file = re.search(r"study: (.*)", out)[1]
    before = files_of(tmp_path / "results")
    code, _, err = dess("study", "run", file, "--out", f"results/sweeps/{name}")
    assert code == 0
    assert "48 missions, 48 of them present" in err
    assert files_of(tmp_path / "results") == before


def test_the_command_of_a_sweep_asks_it_again(dess, unrendered, tmp_path):
    prices = ["--price", "uav=20000", "--price", "currency=USD", "--require", "ratio=0.1"]
    file = json.loads(dess(*ASKED, *FIELDS, "--set", "pads=2", *prices, "--json")[1])["study_file"]
    before = files_of(tmp_path / "results")
    question = Question(load_study(file), Path(file).with_suffix(""))
    code, _, err = dess(*shlex.split(question.command)[1:])
    assert code == 0
    assert files_of(tmp_path / "results") == before


def test_the_cheapest_fleet_is_named(dess, unrendered):
    asked = ["sweep", "--scenario", "small.toml", "--set", "uavs=1,2", "--set", "quota=20,40"]
    asked += ["--price", "uav=20000", "--require", "ratio=0.1", "--missions", 5]
    asked += ["--policy", "greedy"]
    code, out, _ = dess(*asked)
    assert code == 0
    assert out.startswith("Buy 1 UAV: 20,000 EUR.\n")
    assert re.search(r"with greedy, \w+ +1 UAV, 20,000 EUR; collection", out)
    assert re.search(r"1 UAV +greedy +20,000 +met: the answer", out)
    assert re.search(r"without a price +a charging pad, charging a battery", out)
    # Missions of the paper may end in the air.
    assert re.search(r"battery for the way home +[\d.]+ % \[", out)
    data = json.loads(dess(*asked, "--json")[1])
    assert [row["selected"] for row in data["table"] if row["uavs"] == 1] == [True, True]
    headline, *lines = data["answers"]
    assert headline == "Buy 1 UAV: 20,000 EUR."
    assert [fact["label"] for fact in data["facts"]] == [line.split(":")[0] for line in lines]
    (ratio,) = (fact for fact in data["facts"] if fact["label"] == "collection ratio")
    assert (ratio["required"], ratio["guaranteed"]) == ("at least 10 %", "at least 9.5 %")
    assert [row["answer"] for row in data["fleets"]] == ["answer", ""]
    assert Path(data["study_file"]).exists()
    (manifest,) = Path("results").rglob("manifest.json")
    shown = json.loads(dess("study", "show", manifest.parent, "--json")[1])
    points = [row["point"] for row in shown["selected"]]
    assert points == [0, 1, None]  # all conditions together have several


def test_the_headline_ranks_by_the_metric_that_was_asked_for(dess, unrendered):
    asked = [*ASKED, *FIELDS]
    for metric, column in (("reward", "reward"), ("ratio", "collection_ratio")):
        code, out, _ = dess(*asked, "--metric", metric)
        rows = json.loads(dess(*asked, "--json")[1])["table"]
        best = max(rows, key=lambda row: row[column])
        words = f"{best['uavs']} UAV{'s' if best['uavs'] > 1 else ''}"
        name = column.replace("_", " ")
        assert re.match(rf"The best is {best['policy']} with {words}, .*: {name} ", out)


def test_a_what_if_question_is_answered_and_asked_again(dess, unrendered, tmp_path):
    plan = dess(*WHAT_IF, "--dry-run")[1]
    assert "24 missions of study what-if (2 policies x 2 design points x 6 replications)" in plan
    assert not (tmp_path / "results").exists()
    code, out, err = dess(*WHAT_IF)
    assert code == 0
    assert "24 missions" in err
    assert re.search(r"random +Baseline +Variation +Paired difference\n", out)
    assert out.startswith("2 UAVs instead of 1: product with ")
    assert out.endswith("page: build/reports/what-if.html\n")
    before = files_of(tmp_path / "results")
    found = json.loads(dess(*WHAT_IF, "--json")[1])
    headline = found["answers"][0]
    assert out.startswith(headline)
    assert f"answer: {headline}\nstudy: {found['study_file']}" in out
    question = Question(load_study(found["study_file"]), Path(found["results"]))
    assert dess(*shlex.split(question.command)[1:])[0] == 0
    assert files_of(tmp_path / "results") == before
    asked = {"settings": {"uavs": 2}, "baseline": {"uavs": 1}, "policies": ["greedy", "random"]}
    asked |= {"scenario": "small.toml", "missions": 6, "seed": 0, "prices": None, "shown": None}
    assert [page[-1] for page in unrendered] == [asked] * 3


def test_an_interruption_names_the_command_that_goes_on(dess, unrendered, monkeypatch):
    monkeypatch.setitem(runner.CHUNK, "batch", 4)
    simulate, calls = workers.Here.run, []

    def interrupted(self, jobs, progress):
        for done in simulate(self, jobs, progress):
            if len(calls) == 3:
                raise KeyboardInterrupt
            calls.append(done)
            yield done

    with monkeypatch.context() as patch:
        patch.setattr(workers.Here, "run", interrupted)
        code, out, err = dess(*ASKED, *FIELDS)
    assert (code, out) == (130, "")
    command = re.search(r"interrupted: run (dess study run .*) to complete it", err)[1]
    code, _, err = dess(*shlex.split(command)[1:])
    assert code == 0
    assert "48 missions, 12 of them present" in err  # three chunks of four


BAD = {
    "sweep --set nodes=[[1,1]] --set grid=8,9 --policy ddqn": "ddqn: has learned grid 32",
    "sweep --price uav=-1": "costs.uav: -1 is out of range",
    "sweep --price hour=3": "slot_seconds: is missing",
    "sweep --price uav=1 --require speed=0.9": "'speed' is unknown",
    "sweep --price uav=1 --require success=2": "success: 2.0 is out of range",
    "sweep --price uavs=3": "prices: 'uavs' is unknown",
    "sweep --name a/b": "name: 'a/b' has the wrong form",
    "sweep --price uav=0 --require ratio=0.9": "prices: all are 0",
    "sweep --set quota=1..1000 --set arrival_rate=0..1:1000": "1,000,000 points",
    "what-if --set uavs=2 --missions 1": "--missions",
    "what-if --set uavs=2 --shown tour": "shown: 'tour' is not asked about",
}


@pytest.mark.parametrize("arguments", BAD)
def test_bad_input_gets_one_line_and_leaves_nothing(arguments, refusal):
    command, *words = arguments.split(" ")
    given = ["--scenario", "small.toml", "--missions", "300", "--policy", "greedy,random"]
    assert BAD[arguments] in refusal(command, *given, *words)
