"""The ready inputs of the cases, made once by the project itself: results, a page, a training."""

import shutil
from importlib.resources import files
from pathlib import Path

from dess.analysis import load_study, run_study
from dess.policies import registry
from dess.reports.pages import missing
from dess.reports.pages.notebook import NAMES
from tests.fuzz.case import OUT, Case
from tests.fuzz.child import STDERR
from tests.fuzz.forks import Forks
from tests.fuzz.steps import copy, write
from tests.reports.small import STUDIES, quick

# The names of the ready inputs.
SCENARIO, STUDY, SELECTION, TRAINING = "sea.toml", "study.toml", "selection.toml", "training.toml"
PROCESS = "logger.py"  # of which ``log_slots`` runs in a mission
RESULTS, SELECTED, PAGE, POLICY = "results", "selected", "page.html", "policy"
# A scenario with all sections, a study of it, and the results of the study.
SECTIONS, STUDIED, EXTENDED = "sections.toml", "studied.toml", "extended"
# Small results of the shipped studies with what reports keep beside them, the trained policies,
# and the results that reports and sweeps keep of questions.
REPORTS, TRAINED, ASKED, SWEPT = "reports", "trained", "asked", "swept"
SWEEP = (f"--scenario=../in/{SCENARIO}", "--set=uavs=1..2", "--missions=2", "--name=kept")
ASKED_WITH = {
    "missions": "2",
    "policies": '["greedy"]',
    "scenario": f'"../in/{SCENARIO}"',
    "fields": "{uavs=[1, 2]}",
    "settings": "{uavs=2}",
    "baseline": "{uavs=1}",
    "requirements": "{success=0.1}",
    "prices": "{uav=1000}",
}
TEXTS = Path(__file__).with_name("inputs")
# What scenarios name beside them: nodes, polygons and a map of no-fly cells.
SEAS = ("bay.csv", "oresund.csv", "oresund.geojson", "galway-bay.csv", "galway-bay.txt")
SEAS += ("jade-bight.csv", "jade-bight.geojson")
# The ready inputs that most cases have.
INPUTS = tuple(
    copy(name, f"in/{name}")
    for name in (
        *(SCENARIO, SECTIONS, *SEAS, STUDY, SELECTION, STUDIED, TRAINING, PROCESS),
        *(RESULTS, SELECTED, EXTENDED, POLICY, PAGE),
    )
)


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
            run_study(load_study(name, **changes | fewer), folder / name)
        missing.simulate_missing(NAMES, folder, {})


def write_texts(ready: Path) -> None:
    """Write the scenarios, studies and configs into a new folder: small ones, and the shipped."""
    ready.mkdir(parents=True)
    shipped = (
        files("dess") / "scenarios",
        files("dess.analysis") / "study/shipped",
        files("dess.policies") / "learner/configs",
    )
    for file in (file for folder in (TEXTS, *shipped) for file in folder.iterdir()):
        (ready / file.name).write_bytes(file.read_bytes())


def _run(forks: Forks, name: str, *arguments: str) -> None:
    steps = [copy(path.name, f"in/{path.name}") for path in forks.ready.iterdir()]
    out = () if arguments[-1] == "--results" else ("--out",)
    steps += [] if out else [write(f"{OUT}/{name}/.kept", b"")]  # a report makes no folder for them
    case = Case("ready", (*arguments, *out, f"../out/{name}"), tuple(steps), seconds=600)
    for _, outcome in forks.outcomes([(0, case)]):
        if outcome.code != 0:
            raise RuntimeError(f"dess {' '.join(arguments)} fails: {outcome.text(STDERR)}")
        shutil.copytree(outcome.box / OUT / name, forks.ready / name)
