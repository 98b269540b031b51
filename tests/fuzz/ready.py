"""The ready inputs of the cases, made once by the project itself: results, a page, a training."""

import shutil
from importlib import resources
from pathlib import Path

from analysis import load_study, run_study
from analysis.questions.missions import FOLDER
from analysis.verification import cross_check
from policies import registry
from reports.pages import missions
from reports.pages.notebook import NAMES
from tests.fuzz.case import OUT, Case
from tests.fuzz.child import STDERR
from tests.fuzz.forks import Forks
from tests.fuzz.steps import Copy
from tests.reports.small import STUDIES, quick

# The names of the ready inputs.
SCENARIO, STUDY, SELECTION, TRAINING = "sea.toml", "study.toml", "selection.toml", "training.toml"
RESULTS, SELECTED, PAGE, POLICY = "results", "selected", "page.html", "policy"
# A scenario with all sections, a table that it reads, a study of it, and the results of the study.
SECTIONS, STORM, STUDIED, EXTENDED = "sections.toml", "storm.csv", "studied.toml", "extended"
# Small results of the shipped studies with what reports keep beside them, the trained policies,
# and the results that reports and sweeps keep of questions.
REPORTS, TRAINED, ASKED, SWEPT = "reports", "trained", "asked", "swept"
SWEEP = (f"--scenario=../in/{SCENARIO}", "--set=uavs=1..2", "--missions=2", "--name=kept")
KEPT = FOLDER  # the folder of what pages need beside results
ASKED_WITH = {
    "missions": "2",
    "policies": '["greedy"]',
    "scenario": f'"../in/{SCENARIO}"',
    "fields": "{uavs=[1, 2]}",
    "settings": "{uavs=2}",
    "baseline": "{uavs=1}",
    "example": "{uavs=2}",
    "requirements": "{success=0.1}",
    "prices": "{uav=1000}",
}
_SEA = """
description = "a small sea"
grid = 8
nodes = [[1, 1], [2, 6], [5, 4]]
zone = [5, 0, 3, 2]
uavs = [1, 3]
flying_time = [20, 30]
charge_start = [10, 15]
charge_complete = [40, 60]
quota = 60
"""
_SECTIONS = """
[arrivals]
process = "continuous"
rates = [0.1, 0.0, 0.3]
schedule = "storm.csv"
buffer = 5
service = "newest"

[age]
measured = true
reward = -0.01

[charging]
order = "lowest-battery"
power = 15
measured = true
plan_waits = true

[failures]
uav_rate = 0.01
uav_repair = 5.0
uav_data = "lost"
pad_rate = 0.05
pad_repair = 4.0
node_rate = 0.02
node_repair = 6.0
node_data = "lost"

[wind]
strength = 0.4
direction = 30.0
gusts = 0.2
seed = 3

[[fleet]]
slots_per_cell = 2
rate = 1.5

[[fleet]]
flying_time = 28
quota = 50
"""
_STORM = """slot,factor
5,3.0
20,0.5
"""
_STUDIED = """
description = "a small study with all sections"
scenario = "sections.toml"
policies = ["greedy", "age"]
missions = 4
seed = 7
logged = 2

[design]
kind = "grid"
values."failures.uav_rate" = [0.0, 0.05]
"""
_STUDY = """
description = "a small study"
scenario = "sea.toml"
policies = ["greedy", "random"]
missions = 6
seed = 7
logged = 2

[set]
arrival_rate = 0.02

[design]
kind = "grid"
values.uavs = [1, 2]
"""
_SELECTION = """
description = "the cheapest of a few settings"
scenario = "sea.toml"
policies = ["greedy"]
seed = 7

[design]
kind = "grid"
values.uavs = [1, 2]

[costs]
uav = 1000
hour = 5
slot_seconds = 60
currency = "EUR"

[selection]
procedure = "cheapest"
first = 20
budget = 2000
confidence = 0.9
indifference = 1
check = 10
requirements.success = 0.1
"""
_TRAINING = """
name = "tiny"
scenario = "../in/sea.toml"
hidden = [16, 16]
num_envs = 8
learning_starts = 60
replay = 80
batch = 32
n_step = 3
average_rate = 0.01
evaluate_every = 25
evaluation_missions = 4
window = 2

[[phases]]
name = "harvest"
ticks = 60
battery = false

[[phases]]
name = "battery"
ticks = 60
epsilon = [0.5, 0.01]
epsilon_decay = 0.5
"""


def make(forks: Forks) -> None:
    """Make the ready inputs in the folder ``forks.ready``.

    Raises:
        RuntimeError: If a command that makes them fails.
    """
    ready = forks.ready
    write_texts(ready)
    _run(forks, RESULTS, "study", "run", f"../in/{STUDY}")
    _run(forks, SELECTED, "study", "run", f"../in/{SELECTION}")
    _run(forks, EXTENDED, "study", "run", f"../in/{STUDIED}")
    _run(forks, POLICY, "train", f"../in/{TRAINING}")
    _run(forks, "pages", "report", f"../in/{RESULTS}")
    _make_reports(ready / REPORTS)
    shutil.copytree(registry.TRAINED, ready / TRAINED)
    given = [f"--parameter={name}={value}" for name, value in ASKED_WITH.items()]
    pages = ("--out", "../out/pages", "--results")
    _run(forks, ASKED, "report", "what-if", "sweep", "own-sea", *given, *pages)
    _run(forks, SWEPT, "sweep", *SWEEP, *pages)
    shutil.copyfile(ready / "pages" / f"study-{Path(STUDY).stem}.html", ready / PAGE)


def _make_reports(folder: Path) -> None:
    """Results of all shipped studies, of fewer missions than the tests of the reports have."""
    with quick():
        for name, changes in STUDIES.items():
            fewer = {key: min(value, 8) for key, value in changes.items() if key == "missions"}
            study = run_study(load_study(name, **changes | fewer), folder / name)
            if name == cross_check.STUDY:
                cross_check.write(cross_check.simulate_missions(study, 2), folder)
        missions.make(NAMES, folder, {})


def write_texts(ready: Path) -> None:
    """Write the scenarios, studies and configs into a new folder: small ones, and the shipped."""
    ready.mkdir(parents=True)
    texts = {SCENARIO: _SEA, STUDY: _STUDY, SELECTION: _SELECTION, TRAINING: _TRAINING}
    texts |= {SECTIONS: _SEA + _SECTIONS, STORM: _STORM, STUDIED: _STUDIED}
    for name, text in texts.items():
        (ready / name).write_text(text, "utf-8")
    folders = {"dess": "scenarios", "analysis": "study/shipped", "policies": "ddqn/configs"}
    for package, folder in folders.items():
        for file in resources.files(package).joinpath(folder).iterdir():
            (ready / file.name).write_bytes(file.read_bytes())


def _run(forks: Forks, name: str, *arguments: str) -> None:
    steps = [Copy(path.name, f"in/{path.name}") for path in forks.ready.iterdir()]
    out = () if arguments[-1] == "--results" else ("--out",)
    case = Case("ready", (*arguments, *out, f"../out/{name}"), tuple(steps), seconds=600)
    for _, outcome in forks.outcomes([(0, case)]):
        if outcome.code != 0:
            raise RuntimeError(f"dess {' '.join(arguments)} fails: {outcome.text(STDERR)}")
        shutil.copytree(outcome.box / OUT / name, forks.ready / name)
