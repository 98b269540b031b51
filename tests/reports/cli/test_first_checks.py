"""All checks of a command come before its first mission, and a refused command leaves nothing."""

from pathlib import Path

import pytest

import dess as simulator
from analysis.execution import evaluation, runner
from tests.analysis.small import files_of

SWEEP = "sweep --scenario small.toml --set uavs=1,2 --missions 3"
STUDY = "study run trial.toml --out trial"
EVALUATE = "evaluate --scenario small.toml --missions 5 --policy greedy"
MISSION = "simulate --scenario small.toml"
ASK = "report what-if --set uavs=2 --parameter scenario='small.toml' --parameter missions=4"
# Of a command the end that is refused, and what the message says.
REFUSED = {
    f"{SWEEP} --metric age": "--metric: 'age' is not measured; allowed: ratio, product,",
    f"{SWEEP} --set charging.measured=true,false --metric age": "allowed: ratio, product, success",
    f"{SWEEP} --metric cost": "--metric: 'cost' is not measured; allowed: ratio, product,",
    f"{SWEEP} --metric produkt": "--metric: 'produkt' is not measured (did you mean product",
    f"{SWEEP} --out loop": "loop: cannot be written: ",
    f"{SWEEP} --out loop/pages": "cannot be written: ",
    f"{SWEEP} --out linked": "linked/.index.lock: is a link; allowed: ",
    f"{SWEEP} --out taken": "taken/index.html: is a folder; allowed: a file",
    f"{SWEEP} --results loop": "cannot be written",
    "study run aged.toml --out trial": "selection.metric: age is not measured at every design",
    "study run precise.toml --out trial": "precision.targets: age is not measured at every design",
    f"{STUDY} --policy greedy --policy ddqn": "policy ddqn: has learned grid 32, not 8",
    "study run trial.toml --out loop": "cannot be written: ",
    "study run trial.toml --out small.toml": "Not a directory",
    f"{EVALUATE} --policy ddqn": "policy ddqn: has learned grid 32, not 8",
    f"{EVALUATE} --policy greedy,greedy,greedy,greedy": "the largest fleet has 3 UAVs",
    f"{MISSION} --events loop/log.parquet": "cannot be written: ",
    f"{MISSION} --events small.toml/log.parquet": "cannot be written: Not a directory",
    f"{MISSION} --figure taken/index.html": "--figure: taken/index.html is not a picture",
    f"{MISSION} --figure pictures.png": "pictures.png: is a folder; allowed: a file",
    f"{MISSION} --animation mission.avi": "--animation: mission.avi is not an animation",
    "train quick --out loop": "cannot be written: ",
    "train quick --out small.toml": "Not a directory",
    "train quick --out taken": "taken: holds other files",
    f"{ASK} --out loop": "cannot be written: ",
    f"{ASK} --out linked": "linked/.index.lock: is a link",
    f"{ASK} --results small.toml": "Not a directory",
}


@pytest.fixture
def broken(tmp_path: Path) -> Path:
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
    return tmp_path


@pytest.mark.parametrize("line", REFUSED, ids=range(len(REFUSED)))
def test_what_cannot_end_well_is_refused_before_the_first_mission(
    line: str, dess, broken: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def mission(*_: object, **__: object) -> None:
        raise AssertionError("a mission was simulated")

    monkeypatch.setattr(runner.Here, "run", mission)
    monkeypatch.setattr(evaluation, "means", mission)
    monkeypatch.setattr(simulator, "simulate", mission)
    before = files_of(broken)
    code, out, err = dess(*line.split())
    assert (code, out) == (2, "")
    assert REFUSED[line] in err
    assert files_of(broken) == before
