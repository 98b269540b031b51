"""One study on any machines: a process, two, a cluster with TLS, shards that are killed."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dess import InputError
from dess.analysis import run_study
from dess.analysis.execution import workers
from dess.analysis.execution.runner import run_shard
from dess.analysis.execution.workers import Cluster
from dess.analysis.results.merge import merge_shards
from dess.analysis.results.shards import Shard
from tests.analysis.small import CHUNK_SIZE, environment, files_of

HOW_TO = Path(__file__).parents[3] / "docs" / "how-to" / "distributed.md"
# A shard whose process is killed in its second chunk.
KILLED = f"""
import os, signal, sys
from pathlib import Path
from dess.analysis.execution.runner import CHUNK, run_shard
from dess.analysis.results.shards import Shard
from tests.analysis.small import divided_study
CHUNK["batch"] = {CHUNK_SIZE}
study = divided_study(Path())
done = []
def count(missions):
    done.append(missions)
    if sum(done) > CHUNK["batch"]:
        os.kill(os.getpid(), signal.SIGKILL)
run_shard(study, sys.argv[1], Shard(2, 4), progress=count)
"""
SERVE = """
import sys
from distributed import LocalCluster
from distributed.security import Security
if __name__ == "__main__":
    options = {"threads_per_worker": 1, "dashboard_address": None, "security": Security()}
    with LocalCluster(n_workers=2, protocol="tls", **options) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


def test_four_shards_of_which_one_was_killed_leave_the_same_bytes(study, expected, tmp_path):
    folder = tmp_path / "shared"
    for number in (1, 3, 4):
        run_shard(study, folder, Shard(number, 4))
    words = [sys.executable, "-c", KILLED, str(folder)]
    killed = subprocess.run(words, cwd=tmp_path, env=environment(), check=False)
    assert killed.returncode == -signal.SIGKILL
    with pytest.raises(InputError, match="shard 2/4 missing or incomplete"):
        merge_shards([folder])
    done = []
    run_shard(study, folder, Shard(2, 4), progress=done.append)
    assert done[:2] == [CHUNK_SIZE] * 2  # the first chunk was there
    merge_shards([folder])
    assert files_of(folder) == expected


@pytest.mark.slow
def test_two_workers_and_a_cluster_with_tls_leave_the_same_bytes(
    study, expected, tmp_path, monkeypatch
):
    """The certificates and the settings are those of the page."""
    pytest.importorskip("distributed")
    from dask import config

    run_study(study, tmp_path / "two", workers=2)
    assert files_of(tmp_path / "two") == expected
    monkeypatch.setenv("HOME", str(tmp_path))
    blocks = re.findall(r"^```sh\n(.*?)^```", HOW_TO.read_text("utf-8"), re.M | re.S)
    (certify,) = [block for block in blocks if "openssl" in block]
    subprocess.run(["bash", "-ec", certify], check=True, capture_output=True)
    settings = tmp_path / ".config" / "dask" / "dess.yaml"
    variables = environment() | {"DASK_CONFIG": str(settings)}
    words = [sys.executable, "-c", SERVE]
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=variables
    ) as serving:
        address = serving.stdout.readline().strip()
        assert address.startswith("tls://")
        with pytest.raises(InputError, match="no certificates"), Cluster(address):
            pass
        with config.set(config.merge(config.config, config.collect(paths=[settings]))):
            run_study(study, tmp_path / "out", scheduler=address)
            monkeypatch.setattr(workers, "ANSWER", 0.5)
            with pytest.raises(InputError, match="cannot be reached"):
                Cluster(address.replace("tls", "tcp")).__enter__()
        serving.stdin.close()
    assert files_of(tmp_path / "out") == expected
