import pytest

from analysis.execution import effort
from analysis.execution.effort import (
    MAX_WORKERS,
    TRIAL,
    are_few,
    channel_memory,
    check_time,
    check_workers,
    check_workers_memory,
    seconds_per_mission,
)
from dess import InputError, load_scenario
from dess.channel import world_of
from dess.code import memory
from policies import load_team

PAPER = load_scenario("paper")


@pytest.mark.parametrize("workers", [0, -1, MAX_WORKERS + 1, 10**9])
def test_numbers_of_workers_have_limits(workers):
    with pytest.raises(InputError, match=rf"workers: {workers} is out of range; allowed: 1..1,024"):
        check_workers(workers)
    check_workers(MAX_WORKERS)


def test_the_memory_of_the_channel_is_that_of_its_tables():
    world = world_of(PAPER)
    assert channel_memory(PAPER) == world.order.nbytes + world.means.nbytes


def test_workers_need_the_memory_that_is_available(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2**31)
    check_workers_memory("a study", 6, [PAPER], 0.0)
    check_workers_memory("an evaluation", 200, [PAPER], 0.0, are_processes=False)
    for workers, more in ((20, 0.0), (1, 2.0**32)):
        with pytest.raises(InputError, match=r"a study: about .* GiB of memory.*: --yes, or less"):
            check_workers_memory("a study", workers, [PAPER], more)
    wide = load_scenario("paper", grid=200, nodes=[[x, 0] for x in range(100)])
    with pytest.raises(InputError, match="GiB of memory"):
        check_workers_memory("an evaluation", 4, [wide], 0.0, are_processes=False)


def test_few_missions_are_few_where_they_are_short():
    assert are_few(10_000, PAPER)
    assert not are_few(10_001, PAPER)
    assert not are_few(100, load_scenario("paper", uavs=16, max_slots=100_000))


def test_more_than_an_hour_is_refused():
    check_time("a study", 3600.0)
    with pytest.raises(InputError, match="a study, about 2 hours; allowed: --yes, or less"):
        check_time("a study", 7200.0)


def test_a_slow_mission_is_tried_alone(monkeypatch):
    asked, times = [], iter([0.0, 0.0, 0.0, 20.0])

    def spaces(missions):
        asked.append(missions)
        return [load_scenario("paper", quota=1)] * missions

    team = load_team("random")
    assert seconds_per_mission(spaces, team, clock=lambda: next(times)) == 20.0
    assert asked == [1, 1]
    times = iter([0.0, 0.0, 0.0, 1.0, 0.0, 4.8])
    assert seconds_per_mission(spaces, team, "events", lambda: next(times)) == 4.8 / TRIAL
    assert effort.LONG_RUN == 3600.0
