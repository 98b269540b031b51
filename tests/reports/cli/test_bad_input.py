"""Bad input: exit code 2, one line that names the key and the allowed values, no files."""

import pytest

# Arguments, and what the line on stderr must name.
BAD = {
    "simulat": ["No such command 'simulat'. Did you mean 'simulate'?"],
    "simulate --polcy greedy": ["No such option: --polcy", "--policy"],
    f"report {'x' * 300}": ["is unknown; allowed: own-sea"],
    "report what-if --parameter missons=3": ["'missons' is unknown to what-if (did you mean"],
    "report what-if --parameter policies=greedy": ["text in quotes: 'scenario=\"bay\"'"],
    "study run comparson": ["no such study (did you mean comparison?)"],
    "train quik --out out": ["no such config (did you mean quick?)"],
    "simulate --scenario nope": ["nope: no such scenario", "bay, biscay-corner, fig1"],
    "simulate --scenario .": ["cannot be read"],
    "simulate --policy gredy": ["'gredy' is unknown", "did you mean greedy"],
    "simulate --policy greedy,tour,nearest --set uavs=2": ["3 policies", "2 at most"],
    "evaluate --policy greedy --policy greedy,tour --set uavs=1": ["2 policies", "1 at most"],
    "study run trial.toml --policy greedy,tour,random,tour": ["largest fleet", "3 at most"],
    "simulate --policy none.py:Eager": ["none.py: no such file; allowed: FILE.py:CLASS"],
    "policies show gredy": ["'gredy' is unknown (did you mean greedy?)"],
    "scenarios show paper --set uvs=2": ["uvs: unknown key (did you mean uavs?)"],
    "simulate --seed -1": ["seed: -1", "0..2**64-1"],
    "simulate --replication 4294967296": ["replication: 4294967296", "0..2**32-1"],
    "simulate --set uavs": ["'uavs' is not KEY=VALUE"],
    "simulate --set uavs=two": ["uavs: 'two' has the wrong form", "an integer or [low, high]"],
    "simulate --set arrival_rate=lots": ["arrival_rate: 'lots' is not a number", "0..100"],
    "simulate --set arrivals.process=poisson": ["'poisson' is unknown; allowed: slotted, contin"],
    "simulate --set arrivals.buffer=3": ["slotted arrivals have no rates", "allowed: continuous"],
    "simulate --set uavz=1": ["uavz: unknown key (did you mean uavs?)"],
    "simulate --set uavs=17": ["uavs: 17", "1..16"],
    "simulate --of .": ["manifest.json: no such file", "a results folder"],
    "simulate --point 2": ["--point: belongs to a study", "with --of"],
    "simulate --events a.png --figure ./a.png": ["the same file; allowed: a file for each"],
    "evaluate --policy greedy --engine fast": ["--engine", "'batch', 'events'"],
    "study run trial.toml --policy gredy": ["trial.toml: policies", "'gredy' is unknown"],
    "study run trial.toml --out .": ["no manifest.json", "another --out"],
    "study run trial.toml --dry-run --out .": ["no manifest.json", "another --out"],
    "study show trial --policy tour": ["trial/manifest.json: no such file"],
    "study show nope --csv --json": ["--csv: not with --json"],
    "study show nope --target speed=1": ["--target: 'speed' is unknown", "success"],
    "study": ["Missing command", "dess study --help"],
    "report .": ["manifest.json: no such file", "made by dess study run"],
    "report mission": ["holds no results of study fig1", "dess study run fig1 --out"],
    "report comparison": ["holds no results of study comparison", "dess study run comparison"],
    "report mission --set uavs=5": ["--set: mission takes no --set", "what-if"],
    "report what-if --set uavs": ["--set: 'uavs' is not KEY=VALUE"],
    "report what-if --parameter speed=2": ["'speed' is unknown to what-if", "baseline, missions"],
    "report what-if --parameter speed": ["--parameter: 'speed' is not KEY=VALUE"],
    "report what-if --parameter results='x'": ["parameter: 'results' is unknown"],
    "verify nope": ["nope: no such file"],
    f"verify {'x' * 300}": ["File name too long; allowed: another path"],
    "verify small.toml": ["small.toml: is not a page of dess"],
    "verify .": [".: contains no results and is not a page"],
}


@pytest.mark.parametrize("arguments", BAD)
def test_bad_input_gets_one_line_and_leaves_nothing(arguments, refusal):
    line = refusal(*arguments.split(" "))
    for part in BAD[arguments]:
        assert part in line
