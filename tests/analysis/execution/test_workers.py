import json
import shlex

import pytest

from dess import InputError
from dess.analysis import load_results, run_study
from dess.analysis.execution.runner import ChunkError
from tests.analysis import troublesome
from tests.analysis.small import files_of, small_study


def failing(study, out, **options):
    """The only failure of a study: its file and what it says."""
    with pytest.raises(ChunkError) as error:
        run_study(study, out, **options)
    ((path, failure),) = error.value.failures.items()
    assert path.parent == out / "failures"
    assert json.loads(path.read_text()) == vars(failure)
    return failure


def check_that_the_rest_is_there(study, out, policy, missing):
    """All chunks but one of one policy are there, and the results say that they are incomplete."""
    with pytest.raises(InputError, match=f"missions of {policy} .*1 chunks failed, see .*failures"):
        load_results(out)
    done = []
    with pytest.raises(ChunkError):
        run_study(study, out, progress=done.append)
    assert done[0] == study.missions * len(study.policies) - missing


@pytest.fixture
def trouble(tmp_path):
    """The file of policies that get into trouble."""
    return troublesome.copied(tmp_path)


def test_a_chunk_that_raises_is_recorded_and_the_rest_goes_on(trouble, tmp_path):
    raising = f"{trouble}:Raising"
    study = small_study(tmp_path, policies=[raising, "greedy"])
    failure = failing(study, tmp_path / "out")
    assert failure.policy == raising
    assert failure.missions == 4
    assert failure.error == "ZeroDivisionError: nothing to divide by"
    assert "in trouble" in failure.traceback
    assert shlex.split(failure.command)[-4:] == ["--policy", raising, "--replication", "5"]
    check_that_the_rest_is_there(study, tmp_path / "out", raising, 4)


@pytest.mark.slow
@pytest.mark.brief
def test_a_killed_worker_is_replaced(trouble, tmp_path):
    policies = [f"{trouble}:KilledOnce", f"{trouble}:Raising", "greedy"]
    study = small_study(tmp_path, policies=policies)
    done: list[int] = []
    failure = failing(study, tmp_path / "out", workers=2, progress=done.append)
    assert (tmp_path / "killed").exists()
    assert (failure.policy, failure.missions, sum(done)) == (policies[1], 4, 30)
    assert "in trouble" in failure.traceback
    # It has been killed, so it hovers.
    failing(study, tmp_path / "undisturbed")
    ours, undisturbed = (
        {name: content for name, content in files_of(tmp_path / run).items() if "fail" not in name}
        for run in ("out", "undisturbed")
    )
    assert ours == undisturbed


@pytest.mark.slow
def test_a_chunk_that_kills_every_worker_is_given_up(trouble, tmp_path):
    killed = f"{trouble}:KilledAlways"
    study = small_study(tmp_path, policies=[killed, "greedy"])
    failure = failing(study, tmp_path / "out", workers=2)
    assert failure.policy == killed
    assert failure.missions == 4
    assert "its workers died" in failure.error
    assert shlex.split(failure.command)[-4:] == ["--policy", killed, "--replication", "5"]
