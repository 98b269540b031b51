"""A command that is killed at any moment is completed by the same command, to the same bytes."""

import os
import random
import signal
from contextlib import suppress
from functools import partial
from itertools import count

import pytest

from dess.analysis import run_study
from tests.analysis.small import files_of, small_study
from tests.killing import Command, kill

pytestmark = pytest.mark.skipif(os.name != "posix", reason="sends signals")

# SIGHUP and SIGINT have the handler of SIGTERM.
SIGNALS = [signal.SIGKILL, signal.SIGTERM]
KILLS = 12  # by each signal


def seeded(*words):
    """A generator whose seed is printed."""
    seed = " ".join(map(str, words))
    print(f"seed {seed!r}")
    return random.Random(seed)


# --- studies ---

CHUNKS = """\
from dess.analysis.execution import runner
runner.CHUNK['events'] = 5
runner.BOUNDS_CHUNK = 2"""


def a_study(folder, workers, missions, bounds=False):
    """The command that runs a study of two policies with chunks of five missions, or two bounds."""
    folder.mkdir()
    small_study(folder)
    with open(folder / "trial.toml", "a") as study:
        study.write(f'engine = "events"\nbounds = {str(bounds).lower()}\n')
    words = ["study", "run", "trial.toml", "--missions", missions, "--workers", workers]
    return Command([*map(str, words)], folder, CHUNKS)


def chunks(command):
    """The number of chunks of missions in the results folder."""
    return len([*command.out.glob("missions/*/*.parquet")])


def bounds(command):
    """The number of chunks of bounds, which come after all missions."""
    return len([*command.out.glob("bounds/*.parquet")])


def check_studies(folder, workers, number, kills, missions, progress=chunks):
    """Studies that are killed while there is progress equal one that is not."""
    study = partial(a_study, workers=workers, missions=missions, bounds=progress is bounds)
    undisturbed = study(folder / "undisturbed")
    undisturbed.run()
    whole = files_of(undisturbed.out)
    assert progress(undisturbed) > 0
    commands = (study(folder / f"killed-{n}") for n in count())
    for killed in kill(commands, number, kills, progress, 0.2, seeded("study", number, workers)):
        assert files_of(killed.out) == whole


@pytest.mark.slow
def test_a_killed_study_equals_an_undisturbed_one(tmp_path):
    check_studies(tmp_path, 1, signal.SIGKILL, 1, 100)


@pytest.mark.slow
def test_workers_go_with_a_killed_run(tmp_path):
    """That no process of a killed command goes on is checked after every kill."""
    command = a_study(tmp_path / "study", 2, 4000)

    def at_work():
        return chunks(command) > 1 and len([*command.processes()]) > 2

    assert command.kill(signal.SIGKILL, at_work, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("number", SIGNALS)
def test_studies_that_are_killed_equal_an_undisturbed_one(number, workers, tmp_path):
    check_studies(tmp_path, workers, number, KILLS // 2, 1000)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("number", [*SIGNALS, signal.SIGINT])
def test_studies_that_are_killed_in_their_bounds_equal_an_undisturbed_one(
    number, workers, tmp_path
):
    check_studies(tmp_path, workers, number, KILLS // 4, 60, bounds)


# --- pages ---


def a_page(folder, results):
    """The command that renders the page of a study."""
    folder.mkdir()
    return Command(["report", str(results)], folder)


def renderings(command):
    """When notebooks were run last [ns]; 0 before the first."""
    with suppress(FileNotFoundError):  # gone in the meantime
        folders = command.temporary.glob("dess-pages-*")
        return max((path.stat().st_ctime_ns for path in folders), default=0)
    return 0


@pytest.fixture
def results(tmp_path):
    """Results of a small study; nothing is rendered yet."""
    run_study(small_study(tmp_path), tmp_path / "results")
    return tmp_path / "results"


@pytest.mark.slow
@pytest.mark.brief
def test_a_report_that_is_terminated_leaves_no_page_no_process_and_no_file(results, tmp_path):
    command = a_page(tmp_path / "pages", results)
    assert command.kill(signal.SIGTERM, lambda: renderings(command) > 0, 0.5)
    assert not command.out.exists()
