"""The figures of the model cards are those that their commands compute."""

import re

import pandas as pd
import pytest

from benchmarks import model_cards, seas
from dess.files.tables import read_table
from dess.sea.families import seas_of
from policies.about import CARD
from policies.registry import TRAINED, trained_names

MEASURED = read_table(model_cards.BENCHMARKS / "seas.parquet").to_pandas()
ANY = (TRAINED / "any" / CARD).read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in trained_names() if name != "any"])
def test_the_card_of_a_policy_is_what_its_command_writes(name: str) -> None:
    text = (TRAINED / name / CARD).read_text("utf-8")
    (command,) = re.findall(r"^- Command: `(.*)`$", text, re.M)
    assert model_cards.card(TRAINED / name, command, 1000) in text


def test_the_card_of_any_has_the_tables_of_the_measured_missions() -> None:
    assert seas.tables(MEASURED) in ANY


@pytest.mark.slow
@pytest.mark.parametrize("sea", seas_of("test")[::60])
def test_the_measured_missions_are_those_of_this_version(sea: str) -> None:
    of_sea = MEASURED[MEASURED["sea"] == sea]
    chosen = {policy: n for policy, n in seas.MISSIONS.items() if policy != "planner-long"}
    again = seas.missions_on(sea, chosen).reset_index(drop=True)
    kept = of_sea[of_sea["policy"] != "planner-long"].reset_index(drop=True)
    pd.testing.assert_frame_equal(again, kept, check_dtype=False)
