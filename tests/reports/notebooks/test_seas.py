"""The page on seas begins with what a policy reaches on seas that it has not seen."""

from pathlib import Path

from analysis import load_study, run_study
from analysis.answers import comparison, seas
from tests.reports.small import quick, said_by, words

NAMES = {"policy": "nearest", "reference": "greedy", "baseline": "tour"}


def test_it_begins_with_the_answer(tmp_path: Path) -> None:
    design = {"kind": "grid", "values": {"scenario": ["coast:2", "scattered:2", "large:2"]}}
    study = load_study("seas", policies=[*NAMES.values()], missions=4, design=design)
    with quick():
        results = run_study(study, tmp_path / "seas")
        comparison.make(tmp_path, results)
    text = said_by("seas", results=str(tmp_path), **NAMES)
    answer = seas.answer(results, comparison.read(tmp_path, results), *NAMES.values())
    assert text.lstrip().startswith(words(answer)[:60])
    assert "coast:2" in text
