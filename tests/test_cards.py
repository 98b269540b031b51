"""The figures of the model cards are those that their command computes."""

import re

import pytest

from benchmarks import model_cards
from dess.policies.registry import CARD, TRAINED, trained_names


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in trained_names() if name != "generalist"])
def test_the_card_of_a_policy_is_what_its_command_writes(name):
    text = (TRAINED / name / CARD).read_text("utf-8")
    (command,) = re.findall(r"^- Command: `(.*)`$", text, re.M)
    assert model_cards.card(TRAINED / name, command, 1000) in text
