"""Years of a small sea: their facts, calendar and table, and what decides the age of the data."""

import re

import numpy as np
import pytest

from dess import InputError
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.settings import years
from dess.analysis.answers.settings.ranking import ranking_metric
from dess.analysis.ask import around
from dess.analysis.ask.answer import settings_answer
from dess.analysis.ask.question import sweep_question
from dess.analysis.weather import MONTHS, hours_by_month
from dess.model.record import AGES_OF_MONTHS
from dess.scenario.weather.hours import hours_of
from dess.scenario.weather.hours import years as whole_years
from tests.analysis.small import found_of, write_years

ASKED = {"prices": {"uav": 20_000, "years": 5}, "requirements": {"age": "100 h"}, "years": 2}
HOURS = (8760, 8784)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """The answer of a search for the cheapest fleet in two years, with the changes around it."""
    folder = tmp_path_factory.mktemp("years")
    scenario = write_years(folder)
    question = sweep_question({"uavs": (1, 2)}, scenario, ["greedy"], folder=folder, **ASKED)
    results = question.ask()
    around.question_around(results, str(scenario)).ask()
    return settings_answer(results, question)


def test_a_month_has_the_hours_that_its_weather_closes(asked):
    """Of the two operating hours of a day, January has none, and July 21 days of 31."""
    space = asked.results.scenario()
    table = hours_by_month(space, whole_years(hours_of(space)))
    assert [*table.index] == [*MONTHS] and table.sum(axis=1).to_numpy() == pytest.approx(24)
    assert table["night"].to_numpy() == pytest.approx(22)
    assert table.loc["Jan", ["open", "wind"]].tolist() == pytest.approx([0, 2])
    waves = 2 * 10 / 31
    assert table.loc["Jul", ["open", "limits.waves"]].tolist() == pytest.approx([2 - waves, waves])
    others = table.drop(["Jan", "Jul"])
    assert others["open"].to_numpy() == pytest.approx(2) and not others["wind"].any()


def test_the_ages_of_the_months_make_up_that_of_the_year(asked):
    table = years.years_of_setting(asked.results, "greedy", 1)
    assert table["year"].tolist() == [2019, 2020]
    for row, hours in zip(table.itertuples(), HOURS, strict=True):
        begins = np.arange(f"{row.year}-01", f"{row.year + 1}-02", dtype="datetime64[M]")
        lengths = np.diff(begins.astype("datetime64[h]")).astype(int)
        assert lengths.sum() == hours
        ages = [getattr(row, name) for name in AGES_OF_MONTHS]
        assert np.average(ages, weights=lengths) == pytest.approx(row.age_h)
        assert np.mean(row.node_ages_h) == pytest.approx(row.age_h)
    calendar = years.calendar_of(asked.results, "greedy", 1)
    # What January has left is collected in February, the oldest data first.
    assert calendar["age_h"].idxmax() in ("Jan", "Feb")
    assert (calendar["age_h_least"] <= calendar["age_h"]).all()
    assert (calendar["age_h"] <= calendar["age_h_most"]).all()


def test_a_headline_says_what_to_buy_and_how_old_data_are(asked):
    table = years.years_of_setting(asked.results, "greedy", 1)
    bought, told = asked.headline().split(". ", 1)
    assert bought == "Buy 2 UAVs: 8,000 EUR a year"
    assert told == (
        f"Data are {table['age_h'].mean():.0f} h old on average, {table['age_h'].max():.0f} h in "
        "the worst of 2 years."
    )


def test_facts_of_years_are_those_of_their_records(asked):
    found = found_of(asked.facts())
    table = years.years_of_setting(asked.results, "greedy", 1)
    assert found["measured in"] == "2 years of the search"
    assert found["years"] == "2019 and 2020, all of weather.csv"
    assert found["other years"] == "nothing is known of them by 2 years"
    worst = table.loc[table["age_h"].idxmax()]
    assert found["worst year"] == f"{worst.year}, age of information {worst.age_h:.4g} h"
    late = f"{100 * table['late'].mean():.1f} % on land more than 24 h after they were made"
    assert found["late data"] == late
    oldest = np.mean([*table["node_ages_h"]], axis=0).max()
    assert found["oldest node"].endswith(f"age of information {oldest:.4g} h")
    assert found["windows"] == (
        f"{table['windows'].mean():.0f} a year; the longest gap of a year is "
        f"{table['longest_gap'].mean():.0f} h on average, {table['longest_gap'].max():.0f} h at "
        "most"
    )
    assert found["lost UAVs"] == "0 a year"
    assert found["forecast"].endswith("at most 2 h ahead")


def test_years_are_not_called_missions(asked):
    tables = [part for table in asked.shown_tables() for part in (table.caption, *table.cells)]
    facts = [fact.line for fact in (*asked.facts(), *asked.assumptions())]
    assert not [text for text in (asked.headline(), *tables, *facts) if "mission" in text.lower()]


def test_assumptions_tell_the_weather(asked):
    assumed = found_of(asked.assumptions())
    assert assumed["weather"].startswith("hour by hour, weather.csv")
    assert "20 m/s through the air" in assumed["wind"]
    assert assumed["operating"] == "08:00-10:00, solar time; limits: waves 1.5 m"
    assert assumed["window"].startswith("open hours in a row, at most 2 h")
    assert assumed["data at the start"].startswith("2 MB at the beginning of a year")


def test_a_row_of_the_table_is_a_year_and_the_last_one_their_mean(asked):
    cells, caption, data = years.year_table(asked.results, "greedy", 1)
    assert [*cells["Year"]] == ["2019", "2020", "mean"]
    assert cells["Windows"].tolist()[:2] == [f"{n:.0f}" for n in data["windows"]]
    assert "24 h" in caption


def test_what_decides_is_the_age_with_each_taken_away(asked):
    """Twice the hours, or more days of July, make data younger than those of the fleet."""
    table = around.ages_around(asked.results)
    ages = table.set_index("change")["mean"]
    assert table["change"][0] == around.FLEET
    assert {"3 UAVs", "1 spare UAV", "cruise 12 m/s"} < {*ages.index}
    for change in ("flights round the clock", "no limit of waves"):
        assert ages[change] < ages[around.FLEET]
    assert ages["1 spare UAV"] == ages[around.FLEET]  # none is lost
    assert table["mean"][1:].is_monotonic_increasing
    differences = table["mean"] - table["mean"][0]
    assert table["difference"].to_numpy() == pytest.approx(differences.to_numpy())
    told = found_of(asked.facts())["what decides the age"]
    assert re.match(r"80 h; with still air \d+ h, with flights round the clock \d+ h", told)
    shown = around.table_around(asked.results)
    assert {*shown.cells["What if"]} == {*ages.index}
    # At 19 m/s over ground, a wind of 5 m/s leaves no hour in which all moves can be flown.
    assert "Cannot be simulated here: 7 pads; cruise 19 m/s" in shown.caption
    drawing = around.draw_ages(asked.results)
    assert "on the same 2 years" in drawing.caption


def test_changes_are_asked_in_few_years(asked, monkeypatch):
    monkeypatch.setattr(around, "YEARS", 1)
    asked_again = around.question_around(asked.results, asked.question.study.scenario)
    assert asked_again.study.years == 1


def test_a_search_needs_two_years(tmp_path):
    asked_for = ASKED | {"years": 1, "folder": tmp_path}
    with pytest.raises(InputError, match="years: 1 is too few; allowed: 2 or more"):
        sweep_question({"uavs": (1, 2)}, write_years(tmp_path), ["greedy"], **asked_for)


def test_settings_of_years_are_ranked_by_the_age(asked):
    assert ranking_metric(asked.results) == "age_h"
    assert search_of(asked.results).best.points == (1,)
