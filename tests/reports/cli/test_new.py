"""``dess scenarios new``: a file from options or answers, and a picture beside it."""

import json

import pytest

from dess import load_scenario
from dess.scenario.new_sea import NewScenario

BUOYS = "name,lon,lat\nA,8.10,54.00\nB,8.15,54.03\nC,8.20,54.01\nD,8.12,54.06\n"
ANSWERS = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "base": "8.18, 54.05"},
}
OTHERS = {
    "range": "2 km",
    "horizon": "",
    "reserve": "20 %",
    "hover": "",
    "altitude": "60 m",
    "max_speed": "23 m/s",
    "wind": "8 m/s from SW",
    "uavs": "3",
    "pads": "",
    "zone": "4 x 2",
    "no_fly": "",
}


@pytest.fixture
def buoys(tmp_path):
    (tmp_path / "buoys.csv").write_text(BUOYS)
    return "--nodes", "buoys.csv"


def _set(answers):
    return [word for name, of in answers.items() for word in ("--set", f"{name}={of}")]


def test_a_scenario_is_written_from_options_and_its_sea_is_drawn(dess, buoys, tmp_path):
    code, out, err = dess("scenarios", "new", "my.toml", *buoys, *_set(ANSWERS | {"uavs": "3"}))
    assert (code, err) == (0, "") and "a slot is 21 s, a cell 315 m" in out
    space = load_scenario(tmp_path / "my.toml")
    assert (space.cell_size, space.uavs, space.charging_pads) == (315, (3, 3), 1)
    assert space.names == ("A", "B", "C", "D") and space.landing and space.quota == 0
    assert (tmp_path / "my.png").read_bytes()[:4] == b"\x89PNG"
    text = (tmp_path / "my.toml").read_text()
    assert (
        'charging = "40 min" # time to charge a battery' in text and '# reserve = "20 %" #' in text
    )
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, *_set(ANSWERS))
    assert code == 2 and "my.toml: exists; allowed: " in err


def test_what_is_missing_is_asked_a_question_a_line(dess, buoys, tmp_path, monkeypatch):
    replies = {name: [of] for name, of in (ANSWERS | OTHERS).items()}
    replies["endurance"].insert(0, "35")
    asked = []

    def answer(question):
        asked.append(name := question.partition(":")[0])
        return replies[name].pop(0)

    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("builtins.input", answer)
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, "--set", "cruise=15 m/s")
    assert code == 0 and "'35' has no unit; allowed: a time" in err
    assert asked[:3] == ["endurance", "endurance", "charging"] and {*asked} == {
        *ANSWERS,
        *OTHERS,
    } - {"cruise"}
    space = load_scenario(tmp_path / "my.toml")
    assert (
        space.radio.range == 2000 and space.consumption.slots[0][3] > 1000 and space.uavs == (3, 3)
    )
    assert space.zone[2:] == (4, 2) and space.altitude == 60 and space.flying_time == (80, 80)


def test_rates_are_given_as_a_list(dess, buoys, tmp_path, refusal):
    rates = '[["-7.5 dB", "5.5 kbit/s"], ["0 dB", "50 kbit/s"]]'
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, *_set(ANSWERS | {"rates": rates}))
    assert (code, err) == (0, "")
    assert load_scenario(tmp_path / "my.toml").radio.steps == ((-7.5, 0.044), (0, 0.4))
    line = refusal("scenarios", "new", "no.toml", *buoys, *_set(ANSWERS | {"rates": "5 kbit/s"}))
    assert "rates: '5 kbit/s' has no such pairs; allowed: a list of at most 32 pairs" in line


LINK_BUDGET = {"tx_power": "14 dBm", "noise_figure": "6 dB", "frequency": "868 MHz"}


def test_a_link_budget_takes_the_place_of_the_snr(dess, buoys, tmp_path, refusal):
    answers = ANSWERS | LINK_BUDGET
    del answers["snr"]
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, *_set(answers))
    assert (code, err) == (0, "")
    assert load_scenario(tmp_path / "my.toml").radio.anchor == 1.0
    del answers["frequency"]
    assert "frequency: missing" in refusal("scenarios", "new", "b.toml", *buoys, *_set(answers))


def test_lora_without_an_snr_is_asked_for_its_link_budget(buoys, tmp_path):
    """And where free space ends, which is 1 m if nobody says it."""
    new = NewScenario(tmp_path / "buoys.csv")
    asked = new.questions({"modulation": "lora"})
    assert [name for name in ("snr", *LINK_BUDGET) if name in asked] == [*LINK_BUDGET]
    assert asked["free_space"][1] == ""
    assert "free_space" not in new.questions({"modulation": "lora", "snr": "12 dB at 2 km"})
    assert "free_space" not in new.questions({})


def test_a_wrong_answer_is_asked_again_at_once(dess, buoys, monkeypatch):
    """A base as latitude and longitude, a wind that is too strong: before the next question."""
    replies = {
        "base": ["54.05, 8.18", ANSWERS["base"]],
        "wind": ["15 m/s from SW", "5 m/s from SW"],
    }
    asked = []

    def answer(question):
        asked.append(name := question.partition(":")[0])
        return replies[name].pop(0) if name in replies else OTHERS[name]

    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("builtins.input", answer)
    sheet = {name: of for name, of in ANSWERS.items() if name != "base"}
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, *_set(sheet))
    first = asked.index("wind")
    assert code == 0 and asked[first : first + 4] == ["wind", "wind", "base", "base"]
    assert "is too strong for 15 m/s over ground" in err
    assert "base: '54.05, 8.18' is 5,911 km from the nearest node; allowed: longitude, then" in err


def test_a_buoy_on_land_takes_the_nearest_open_cell(dess, buoys, tmp_path):
    corners = [[8.13, 54.02], [8.17, 54.02], [8.17, 54.04], [8.13, 54.04], [8.13, 54.02]]
    land = {"type": "Polygon", "coordinates": [corners]}
    document = {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": land}]}
    (tmp_path / "land.json").write_text(json.dumps(document))
    answers = ANSWERS | {"no_fly": "land.json"}
    code, _, err = dess("scenarios", "new", "my.toml", *buoys, *_set(answers))
    assert code == 0 and "note: no-fly cells have nodes. Of the 4 nodes, 1 is in the nearest" in err
    assert load_scenario(tmp_path / "my.toml").moved == (1,)
    # A base there cannot be mended so; what was answered is not lost.
    answers["base"] = "8.15, 54.03"
    code, _, err = dess("scenarios", "new", "b.toml", *buoys, *_set(answers))
    assert code == 2 and "b.toml is written, but cannot be simulated: b.toml: zone: " in err
    assert (tmp_path / "b.toml").exists() and (tmp_path / "b.png").exists()


@pytest.mark.parametrize("shift", [0.0, 0.0013, 0.0021, 0.0034, 0.0047])
def test_nodes_are_merged_on_the_grid_that_is_written(dess, tmp_path, shift):
    """Two buoys that are 0.9 cells apart share a cell on some grids, and never by surprise."""
    rows = f"lon,lat\n8.1,54\n8.1,{54.1 + shift}\n8.15,54.03\n8.15,54.03255\n"
    (tmp_path / "near.csv").write_text(rows)
    code, _, err = dess("scenarios", "new", "my.toml", "--nodes", "near.csv", *_set(ANSWERS))
    assert (code, err) == (0, "")
    load_scenario(tmp_path / "my.toml")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"base": "54.05, 188"},
            ["base: '54.05, 188' is no place on the Earth; allowed: longitude"],
        ),
        ({"base": "28.18, 54.05"}, ["base: buoys.csv and the base take ", "allowed: 256 x 256"]),
        ({"no_fly": "none.json"}, ["no_fly: 'none.json' is no file; allowed: the name of a file"]),
        (
            {"endurance": None, "base": None},
            ["endurance, base: missing; allowed: --set "],
        ),
        ({"base": "there"}, ["base: 'there' is no place; allowed: two numbers"]),
        ({"zone": "wide"}, ["zone: 'wide' is no size; allowed: its cells from west to east"]),
        ({"zone": "1x1", "uavs": "3"}, ["zone: '1x1' has 1 cells; allowed: 3 or more, as uavs"]),
        ({"uavs": "many"}, ["uavs: 'many' is out of range; allowed: 1..64"]),
        ({"enduranc": "35 min"}, ["enduranc: unknown key (did you mean endurance?)"]),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(refusal, buoys, changes, words):
    answers = {name: of for name, of in (ANSWERS | changes).items() if of is not None}
    line = refusal("scenarios", "new", "my.toml", *buoys, *_set(answers))
    assert all(word in line for word in words), line


def test_what_follows_from_a_sheet_is_shown(dess, buoys, tmp_path):
    far = ANSWERS | {"range": "1 km", "reserve": "60 %", "base": "8.26, 54.0", "modulation": "lora"}
    code, out, err = dess("scenarios", "new", "far.toml", *buoys, *_set(far))
    assert (code, err) == (0, "")
    unreachable = "out of reach of a UAV from a full battery: A, B, D"
    assert unreachable in out
    code, out, _ = dess("scenarios", "show", "far.toml")
    assert code == 0 and unreachable in out
    assert "rates: 244.1 bit/s from -20 dB on, 439.5 bit/s from -17.5 dB on, " in out
    assert "messages of a node: 17.5 a slot" in out
    assert "without these nodes a collection ratio of 25.0 % is the highest" in out
    assert "not in the sheet, and assumed: altitude 10 m, message 1 kB" in out
    _, out, _ = dess("scenarios", "show", "far.toml", "--json")
    follows = json.loads(out)["follows"]
    assert follows["out_of_reach"] == ["A", "B", "D"] and follows["largest_ratio"] == 0.25
    assert follows["steps"][-1] == [-7.5, pytest.approx(5468.75)]
    of_wing = {"tip_speed": "120 m/s", "induced_speed": "4.03 m/s", "hover": "28.77 min"}
    of_wing["climb"] = "3 m/s"
    assert follows["assumed"] == {"altitude": "10 m", "message": "1 kB"} | of_wing
    assert follows["battery_per_slot"]["hover"] == 1.217
    assert (follows["slot_s"], follows["cell_m"], follows["data_unit_bit"]) == (21, 315, 2625e3)
    assert follows["messages_per_slot"] == [pytest.approx(17.5)] * 2
    code, out, _ = dess("scenarios", "show", "far.toml", "--set", "data_sheet.duty_cycle=1 %")
    assert "54.69 bit/s from -7.5 dB on" in out


def test_without_a_limit_the_scenario_says_so(dess, buoys, tmp_path):
    code, out, _ = dess("scenarios", "new", "my.toml", *buoys, *_set(ANSWERS))
    assert code == 0 and "every node is in range: no limit: give range or rates" in out
