"""Studies by their names, with fields that replace their own."""

import pytest

from dess import InputError
from dess.analysis import load_study


def test_overrides_are_validated_too():
    assert load_study("table4", missions=5).missions == 5
    with pytest.raises(InputError, match="study table4: missions"):
        load_study("table4", missions=0)
    with pytest.raises(InputError, match="study table4: speed: unknown key"):
        load_study("table4", speed=1)


def test_fewer_missions_than_event_logs_keep_a_log_each():
    logged = load_study("fig4").logged
    assert logged > 2
    assert load_study("fig4", missions=2).logged == 2
    assert load_study("fig4", missions=logged).logged == logged
    with pytest.raises(InputError, match="logged: 3 is more than the missions"):
        load_study("fig4", missions=2, logged=3)
