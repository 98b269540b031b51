"""What is told of nodes that no UAV can serve: before a sweep, and in its answer."""

from dess import ScenarioSpace, analysis
from dess.analysis.sheet import unreachable_sentences
from dess.reports.cli.options import note_unreachable
from tests.dess.model.test_reach import SHEET

NODES = {"nodes": [[3, 0], [55, 0], [60, 0]], "names": ["near", "between", "far"]}
SEA = {**NODES, "grid": 64, "rows": 4, "zone": [0, 0, 2, 2]}


def _spaces(*fleets: int) -> list[ScenarioSpace]:
    sheet = SHEET | {"horizon": "50 min"}
    return [ScenarioSpace.of(**SEA, uavs=uavs, data_sheet=sheet) for uavs in fleets]


def test_of_several_fleets_the_one_that_reaches_least_is_told(capsys):
    lost = "out of reach of a UAV from a full battery: far"
    assert unreachable_sentences(_spaces(1)) == [
        lost,
        "without these nodes a collection ratio of 66.7 % is the highest",
    ]
    sentences = unreachable_sentences(_spaces(1, 2, 1))
    assert sentences == [
        lost,
        "beyond the margins that the return guard keeps for 2 UAVs: between",
        "without these nodes a collection ratio of 33.3 % is the highest",
    ]
    note_unreachable(_spaces(1, 2))
    assert capsys.readouterr().err == "".join(f"note: {line}\n" for line in sentences)
    assert unreachable_sentences([ScenarioSpace.of()]) == []


def test_an_answer_tells_it_too(tmp_path):
    [space] = _spaces(1)
    (tmp_path / "sea.toml").write_text(space.to_toml())
    found = analysis.sweep(
        tmp_path / "sea.toml", ["greedy"], 2, folder=tmp_path, progress=False, uavs=[1, 2]
    )
    assert found.answers()[-2:] == [
        "Beyond the margins that the return guard keeps for 2 UAVs: between.",
        "Without these nodes a collection ratio of 33.3 % is the highest.",
    ]
