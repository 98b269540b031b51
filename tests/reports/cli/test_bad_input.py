"""Bad input: exit code 2, one line that names the key and the allowed values, no files.

All checks of a command come before its first mission.
"""

import pytest

from dess.analysis.execution import evaluation, workers
from dess.model.mission import Mission

SWEEP = "sweep --scenario small.toml --set uavs=1,2 --missions 3"
STUDY = "study run trial.toml --out trial"
MISSION = "simulate --scenario small.toml"
ASK = "report what-if --set uavs=2 --parameter scenario='small.toml' --parameter missions=4"
# Arguments, and what the line on stderr must name.
BAD = {
    "simulat": ["No such command 'simulat'. Did you mean 'simulate'?"],
    "simulate --polcy greedy": ["No such option: --polcy", "--policy"],
    f"report {'x' * 300}": ["is unknown; allowed: own-sea"],
    "report what-if --parameter missons=3": ["'missons' is unknown to what-if (did you mean"],
    "report what-if --parameter policies=greedy": ["text in quotes: "],
    "study run comparson": ["no such study (did you mean comparison?)"],
    "train quik --out out": ["no such config (did you mean quick?)"],
    "simulate --policy greedy,tour,nearest --set uavs=2": ["3 policies", "2 at most"],
    "study run trial.toml --policy greedy,tour,random,tour": ["largest fleet", "3 at most"],
    "simulate --set uavs=2..5": ["allowed: one, or dess sweep"],
    "report mission comparison --out pages": ["run fig1 fig4 comparison --out"],
    "simulate --set uavs": ["'uavs' is not KEY=VALUE"],
    "simulate --set arrival_rate=.02": ["arrival_rate: '.02' is no number; allowed: 0.02"],
    "simulate --set quota=1,000": [
        "quota: '1,000' has a comma that may part thousands",
        "1000, or",
    ],
    "sweep --set uavs=1 --set quota=1,000": ["quota: '000' is no number; allowed: 0"],
    f"{SWEEP} --price uav=20,000": ["uav: '20,000' may be a thousand or a", "20000 or 20.0"],
    f"{SWEEP} --price uav=20.000": ["uav: '20.000' may be a thousand or a", "20000 or 20.0"],
    f"{SWEEP} --price uav=20k": ["uav: '20k' is no number; allowed: a price and its amount"],
    f"{SWEEP} --require success=.8": ["success: '.8' is no number; allowed: 0.8"],
    f"{SWEEP} --require success=0,8": ["success: '0,8' is no number; allowed: 0.8"],
    f"{SWEEP} --require success=99%": ["success: '99%' is no number; allowed: 0.99"],
    f"{SWEEP} --price uav=9 --require age=-1": ["age: -1.0 does not fit; allowed: mission slots"],
    f"{SWEEP} --price uav=9 --require success=1.0000001": ["1.0000001 is out of range; allowed: "],
    "simulate --of .": ["manifest.json: no such file"],
    "simulate --point 2": ["--point: belongs to a study", "with --of"],
    "simulate --events a.txt": ["is not an event log"],
    "report --results typo": ["--results: typo: no such folder"],
    "simulate --events a.png --figure ./a.png": ["the same file"],
    "evaluate --policy greedy --engine fast": ["--engine", "'batch', 'events'"],
    "study run trial.toml --out .": [
        "no manifest.json",
        "allowed: a results folder, or a new or empty one",
    ],
    "study show nope --csv --json": ["--csv, --json, --missions: given together"],
    "study": ["Missing command", "dess study --help"],
    "report mission": ["holds no results of 2 studies"],
    "report own-sea --parameter scenario='small.toml' --parameter fields={uavs=[1,2]}": [
        "own-sea has the prices, requirements of its example, bay"
    ],
    "verify nope": ["nope: no such file"],
    "verify small.toml": ["small.toml: is not a page of dess"],
    "verify .": [".: contains no results and is not a page"],
    f"{SWEEP} --metric age": ["--metric: 'age' is not measured"],
    f"{SWEEP} --out loop": ["loop: cannot be written: "],
    f"{SWEEP} --out linked": ["linked/.index.lock: is a link"],
    f"{SWEEP} --out taken": ["taken/index.html: is a folder"],
    f"{SWEEP} --results loop": ["cannot be written"],
    "study run aged.toml --out trial": ["selection.metric: age is not measured at every design"],
    "study run precise.toml --out trial": [
        "precision.targets: age is not measured at every design"
    ],
    f"{STUDY} --policy greedy --policy ddqn": ["ddqn: has learned grid 32"],
    "study run trial.toml --out loop": ["cannot be written: "],
    f"{MISSION} --events loop/log.parquet": ["cannot be written: "],
    f"{MISSION} --animation mission.avi": ["is not an animation"],
    "train quick --out loop": ["cannot be written: "],
    f"{ASK} --out loop": ["cannot be written: "],
}


@pytest.fixture
def broken(dess, tmp_path):
    """A folder with what outputs and studies trip over."""
    (tmp_path / "loop").symlink_to("loop")
    for name in ("linked", "taken/index.html", "pictures.png"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "linked" / ".index.lock").symlink_to("elsewhere")
    head = 'scenario = "small.toml"\npolicies = ["greedy"]\n'
    (tmp_path / "aged.toml").write_text(
        head + 'selection = {procedure = "kn", metric = "age", indifference = 1}\n'
        'design = {kind = "grid", values = {uavs = [1, 2]}}\n'
    )
    (tmp_path / "precise.toml").write_text(head + "precision.targets.age.absolute = 1\n")


@pytest.mark.usefixtures("broken")
@pytest.mark.parametrize("arguments", BAD, ids=range(len(BAD)))
def test_bad_input_gets_one_line_and_leaves_nothing(arguments, refusal, monkeypatch):
    def mission(*_, **__):
        raise AssertionError("a mission was simulated")

    monkeypatch.setattr(workers.Here, "run", mission)
    monkeypatch.setattr(evaluation, "estimate_means", mission)
    monkeypatch.setattr(Mission, "run", mission)
    line = refusal(*arguments.split(" "))
    for part in BAD[arguments]:
        assert part in line
