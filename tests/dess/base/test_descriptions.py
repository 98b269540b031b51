"""What fields are: the parts of their descriptions."""

import copy
import pickle
import re

import pytest

from dess.base.descriptions import Description, description_of
from dess.scenario.fields import fields_of
from dess.scenario.scenario import Scenario, ScenarioSpace

PARTS = {"unit": "m", "symbol": "c", "note": "0 for none", "form": "a number"}


def test_a_description_is_the_text_of_its_parts():
    whole = Description("side of a cell", **PARTS)
    assert whole == "side of a cell [m] (c); 0 for none: a number"
    assert whole.brief == "side of a cell [m] (c)"
    assert whole.without_unit == "side of a cell (c); 0 for none"
    assert Description("side of a cell", form="a number") == "side of a cell: a number"


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda of: pickle.loads(pickle.dumps(of))])
def test_a_copy_has_the_parts(duplicate):
    whole = Description("side of a cell", **PARTS)
    assert (duplicate(whole), vars(duplicate(whole))) == (whole, vars(whole))


@pytest.mark.parametrize("model", [Scenario, ScenarioSpace])
def test_no_unit_and_no_form_of_a_field_is_hidden_in_the_text_of_its_meaning(model):
    meanings = [description_of(field).meaning for field in fields_of(model).values()]
    assert not [text for text in meanings if re.search(r" \[[^],]+\]|: |; ", text)]
