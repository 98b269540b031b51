"""Values of fields in words."""

import pytest

from dess import load_scenario
from dess.analysis.ask.answer import VariationAnswer
from dess.analysis.ask.question import what_if_question
from dess.analysis.names import field_in_words, field_named
from dess.scenario.fields import fields_of
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.small import write_scenario

ZONES = [{"cells": [0, 0, 2, 1], "pads": 1}, {"cells": [0, 4, 1, 1], "pads": 1}]
SEAS = {
    "paper": {},
    "paper with one further zone": {"zones": ZONES[:1], "uavs": 2},
    "jade-bight": {"fleet": [{"endurance": "20 min"}]},
    "corridor:7": {"arrivals.process": "continuous", "arrivals.schedule": [[0, 1.0], [60, 2.0]]},
    "archipelago:11": {},
}


@pytest.mark.parametrize("sea", SEAS)
def test_no_sentence_of_a_variation_has_two_commas(sea):
    """A list of one value was told as ``instead of 1,,``."""
    space = load_scenario(sea.split(" ")[0], **SEAS[sea])
    for field in fields_of(ScenarioSpace):
        value = field_in_words(space, field)
        text = f"With {field_named(field).words(value)} instead of {value}, the product changes"
        assert ",," not in text and ", ," not in text and "()" not in text, field


def test_pads_of_zones_are_told_as_they_were_asked(tmp_path):
    scenario = write_scenario(tmp_path, zones=ZONES)
    settings = {"zones.pads": [0, 1], "uavs": 2}
    question = what_if_question(settings, None, scenario, ["random"], 2, folder=tmp_path)
    sentence = VariationAnswer(question.ask(), question).headline()
    pads = "pads of each further zone 0 + 1 instead of 1 + 1"
    assert pads in sentence and ",," not in sentence
