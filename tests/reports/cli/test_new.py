"""``dess scenarios new``: a file from options or answers, and a picture beside it."""

import pytest

from dess import load_scenario

BUOYS = "name,lon,lat\nA,8.10,54.00\nB,8.15,54.03\nC,8.20,54.01\nD,8.12,54.06\n"
ANSWERS = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "base": "8.18, 54.05"},
}
OTHERS = {
    "range": "2 km",
    "horizon": "",
    "wind": "10 m/s from SW",
    "uavs": "3",
    "pads": "",
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
    assert space.radio.range == 2000 and space.wind.moves[3] > 1 and space.uavs == (3, 3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"endurance": None, "base": None},
            ["endurance, base: missing; allowed: --set "],
        ),
        ({"base": "there"}, ["base: 'there' is no place; allowed: two numbers"]),
        ({"uavs": "many"}, ["uavs: 'many' is out of range; allowed: 1..64"]),
        ({"enduranc": "35 min"}, ["enduranc: unknown key (did you mean endurance?)"]),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(refusal, buoys, changes, words):
    answers = {name: of for name, of in (ANSWERS | changes).items() if of is not None}
    line = refusal("scenarios", "new", "my.toml", *buoys, *_set(answers))
    assert all(word in line for word in words), line
