"""The extras: what works without them, and the line that names the one that is missing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name

from dess.base import libraries
from dess.policies.registry import trained_names
from tests.analysis.small import environment, small_study
from tests.distributions import EXTRAS, absent, homes, requirements

# Runs command lines in a new interpreter in which some packages are not installed.
RUN = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from tests.hiding import hide
hidden, lines = json.loads(sys.argv[1])
hide(hidden)
from dess.reports.cli import main
done = {}
for line in lines:
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        code = main(line.split())
    done[line] = (code, out.getvalue().strip(), err.getvalue().strip())
print(json.dumps(done))
"""


def python(folder: Path, script: str, *arguments: str) -> str:
    """What a script prints in a new interpreter that works in a folder."""
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment())
    assert done.returncode == 0, done.stderr
    return done.stdout


def runs(folder: Path, extras: set[str], *lines: str) -> dict[str, tuple[int, str, str]]:
    """Exit code, stdout and stderr of command lines in an installation with some extras."""
    hidden = sorted(absent(*extras))
    return json.loads(python(folder, RUN, json.dumps([hidden, lines])))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a small study, and a sea with a lane."""
    folder = tmp_path_factory.mktemp("plain")
    small_study(folder)
    line = {"geometry": {"type": "LineString", "coordinates": [[8, 54], [9, 55]]}}
    (folder / "lane.json").write_text(json.dumps({"features": [line]}))
    (folder / "lane.toml").write_text('centre = [8.5, 54.5]\nno_fly = "lane.json"\n')
    return folder


# What works without any extra, and what is missed then: the line, and the extra.
ANSWERED = (
    *("policies", "scenarios", "scenarios show jade-bight", "studies"),
    "simulate --scenario small.toml --events log.parquet",
    "evaluate --scenario small.toml --policy tour --missions 3",
    *("simulate --policy ddqn", "evaluate --policy generalist --policy ddqn-paper --missions 2"),
    *("study run trial.toml --out trial", "study show trial"),
    "sweep --scenario small.toml --set uavs=1,2 --missions 3",
    "verify trial --missions 2",
)
MISSED = {
    "train quick --out run": ("dess train needs PyTorch", "learning"),
    "study run sensitivity --policy greedy --out s": ("dess study needs SALib", "reports"),
    "study run trial.toml --out trial --scheduler tcp://127.0.0.1:1": (
        *("a scheduler needs distributed", "distributed"),
    ),
    "study run trial.toml --out new --report": ("--report needs ", "reports"),
    "study export trial --crate trial.zip": ("dess study needs ", "reports"),
    "simulate --figure mission.png": ("dess simulate needs matplotlib", "reports"),
    "report ./trial": ("dess report needs ", "reports"),
    "scenarios show lane.toml": (
        "no_fly with lines, circles, touched or buffer needs shapely",
        "geo",
    ),
}


@pytest.fixture(scope="module")
def plain(folder):
    """What commands answer in an installation without any extra."""
    return runs(folder, set(), *ANSWERED, *MISSED)


@pytest.mark.slow
@pytest.mark.brief
def test_a_plain_installation_has_the_simulator_and_its_commands(folder, plain):
    for line in ANSWERED:
        code, out, err = plain[line]
        assert code == 0, (line, err)
        assert out, line
    listed = {line.split()[0] for line in plain["policies"][1].splitlines()}
    assert set(trained_names()) < listed
    assert (folder / "log.parquet").exists()


@pytest.mark.slow
@pytest.mark.brief
def test_a_sweep_answers_without_its_page(plain):
    _, out, err = plain[next(line for line in ANSWERED if line.startswith("sweep"))]
    assert "settings by product" in out and "page: " not in out
    assert err.splitlines()[-1].startswith("no page: the page of a sweep needs ")
    assert err.endswith(": pip install '.[reports]' -c constraints.txt")


@pytest.mark.slow
@pytest.mark.brief
def test_what_an_extra_adds_is_missed_in_one_line(folder, plain):
    for line, (what, extra) in MISSED.items():
        code, out, err = plain[line]
        assert (code, out, err.count("\n")) == (2, "", 0), line
        assert err.startswith(f"dess: error: {what}"), err
        command = f"pip install '.[{extra}]' -c constraints.txt"
        assert err.endswith(f", which is not installed; in a clone of the repository: {command}"), (
            err
        )
    assert not {"run", "new", "mission.png"} & {path.name for path in folder.iterdir()}


@pytest.mark.slow
@pytest.mark.brief
def test_packages_are_imported_without_any_extra(folder):
    script = (
        "import json, sys; from tests.hiding import hide; hide(json.loads(sys.argv[1]))\n"
        "import dess, policies, analysis\n"
        "for package in (dess, policies, analysis):\n"
        "    for name in package.__all__: getattr(package, name)\n"
        "team = dess.policies.load_team('generalist,ddqn,ddqn-paper')\n"
        "print(*(policy.name for policy in team))\n"
    )
    assert python(folder, script, json.dumps(sorted(absent()))) == "generalist ddqn ddqn-paper\n"


def test_the_packages_of_an_extra_are_those_of_its_libraries():
    found = homes()
    for extra in libraries.EXTRAS.keys() - {"examples"}:  # those are not installed
        packages = libraries.EXTRAS[extra]
        of_packages = {home for package in packages for home in found[package]}
        unused = {"jupyter"}  # opens notebooks; nothing imports it
        assert of_packages == set(requirements(*EXTRAS[extra])) - unused, extra


def test_the_libraries_of_the_examples_have_the_names_of_their_packages():
    packages = {canonicalize_name(package) for package in libraries.EXTRAS["examples"]}
    assert packages == set(requirements(*EXTRAS["examples"]))


def test_what_is_no_library_of_ours_is_no_library_that_is_missed():
    assert libraries.absence(ModuleNotFoundError(name="my_policies"), "dess") is None
    assert libraries.absence(ModuleNotFoundError(), "dess") is None
    line = str(libraries.absence(ModuleNotFoundError(name="torch.nn"), "a policy"))
    assert line == (
        "a policy needs PyTorch, which is not installed; in a clone of the repository: "
        "pip install '.[learning]' -c constraints.txt"
    )
