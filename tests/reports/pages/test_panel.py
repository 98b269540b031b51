"""A panel simulates in a page what Python simulates; ``dess verify`` finds what was changed."""

import gzip
import io
import json
import re
from base64 import b64decode, b64encode
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Locator
from playwright.sync_api import Page as Tab

from dess import InputError, load_scenario, policies, simulate_batch
from dess.analysis.metrics import HOME, METRICS, PRODUCT, metric_of
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.sequences import add_values, ends_of_what_was_seen, sequence_ends
from dess.analysis.stats.verdict import (
    ABOVE,
    INCONCLUSIVE,
    NOT_RULED_OUT,
    SEEN_ABOVE,
    position_of,
    position_with_allowance,
)
from dess.analysis.study.cheapest import GROWTH, Cheapest, Setting
from dess.analysis.study.prices import Costs
from dess.analysis.wasm.entry import METRICS as METRICS_OF_MODULE
from dess.analysis.wasm.entry import NETWORK
from dess.analysis.wasm.image import copy_inputs, make_image
from dess.reports.pages import index, panel_settings
from dess.reports.pages import panel as panels
from dess.reports.pages.index import make_index
from dess.reports.pages.page import PANEL, Page
from dess.reports.pages.panel import PORTION, make_another, make_panel
from dess.reports.pages.panel_metrics import Search
from dess.reports.pages.panel_missions import CHECKED, hash_missions
from dess.reports.pages.templates import fill_page
from dess.reports.pages.verify import verify_page
from dess.reports.player import player_script
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.small import SCENARIO, SHEET
from tests.compiled import new_sequence
from tests.flown import Engine

PAPER = load_scenario("paper")
SMALL_SHEET = ScenarioSpace.of(**SCENARIO | SHEET)
SEED = 7
MISSIONS = 120  # of a run
PATIENCE = 60_000  # ms
# How the panel begins to say the verdict on a difference.
SAID = {
    ABOVE: "decided: B is higher",
    SEEN_ABOVE: f"{SEEN_ABOVE.removeprefix('above ')}, B is higher, which is better; ",
    INCONCLUSIVE: "no",
}


@pytest.fixture(scope="module")
def panel() -> str:
    baseline, variation = (load_scenario("paper", uavs=uavs) for uavs in (1, 2))
    costs = Costs(uav=1000, pad=300, charge=40)
    panel = make_panel(
        baseline, variation, "paper", ["planner", "greedy"], SEED, costs=costs, given={"uavs": 1}
    )
    return str(panel.data)


@pytest.fixture(scope="module")
def document(panel, tmp_path_factory) -> Path:
    """A page that contains the panel alone."""
    shown = {"title": "A panel", "outcome": "", "library": "", "player": panel}
    path = tmp_path_factory.mktemp("panel") / "page.html"
    path.write_text(fill_page("mission.html", simulates=True, **shown), "utf-8")
    return path


@pytest.mark.parametrize("policy", ["greedy", NETWORK])
def test_the_hashes_are_those_of_the_records_of_the_module(policy):
    """Each is of the bytes of the mission, of its UAVs, and of what extended scenarios measure."""
    space = load_scenario("paper", uavs=[1, 3], age={"measured": True})
    engine = Engine(make_image(space, [policy], SEED, PORTION))
    engine.call("play", 0.0, PORTION)
    kinds = [kind for kind in engine.records() if len(kind)]
    hashes = [
        sha256(b"".join(kind[row].tobytes() for kind in kinds if len(kind))).hexdigest()
        for row in range(PORTION)
    ]
    assert hash_missions(space, policy, SEED, kinds[1].shape[1])[:PORTION] == hashes


def test_every_whole_number_can_be_chosen():
    """Of UAVs, up to that of the page if it is larger; of pads, as many as the zone has cells."""
    for uavs, most in ((3, 8), (11, 11)):
        space = load_scenario("paper", uavs=uavs)
        settings = dict(panel_settings.settings_of(space, space))
        assert settings["uavs"] == [*range(1, most + 1)]
        assert settings["pads"] == [*range(1, 17)]


def test_settings_of_a_data_sheet_are_told_in_its_words():
    """Which zone's pads they are, and failures as a time: 1 in 2000 slots of 21 s is 11.7 h."""
    space = load_scenario("jade-bight")
    told = {
        key: panel_settings.describe_setting(key, values, space, None)
        for key, values in (("pads", [1, 2]), ("failures.uav_rate", [0.0, 0.0005]))
    }
    assert told["pads"]["name"] == "Number of charging pads in zone 1"
    failures = told["failures.uav_rate"]
    assert failures["texts"] == ["none", "one every 11.67 h"]
    assert failures["name"] == "Failures of a UAV in flight, which is then lost for good"
    of_paper = panel_settings.describe_setting("pads", [1, 2], load_scenario("paper"), None)
    assert of_paper["name"] == "Number of charging pads"
    repaired = load_scenario("paper", failures={"uav_rate": 0.001, "uav_repair": 20.0})
    failures = panel_settings.describe_setting("failures.uav_rate", [0.0, 0.001], repaired, None)
    assert failures["texts"] == ["none", "one every 1,000 mission slots"]
    assert failures["name"].endswith("grounded for 20 mission slots in the mean")


def test_wind_data_and_the_pads_of_every_zone_are_settings_where_there_is_a_sheet():
    """They are values of the sheet, and make a page larger by a few kB."""
    space = load_scenario("jade-bight")
    settings = dict(panel_settings.settings_of(space, space))
    assert settings["data_sheet.wind"][0] == "0 m/s from SW"
    assert "8 m/s from SW" in settings["data_sheet.wind"]
    assert settings["data_sheet.data_rate"][:2] == ["0.75 MB/h", "1.5 MB/h"]
    assert settings["zones.pads"] == [1, 2, 3, 4]
    image = make_image(space, ["greedy"], SEED, PORTION, settings)
    assert len(json.dumps(image.document()["sliders"])) < 10_000
    assert not {*panel_settings.OF_SHEET, "zones.pads"} & {
        *dict(panel_settings.settings_of(PAPER, PAPER))
    }
    # A sheet without failures has them by their rate.
    assert "failures.uav_rate" in settings and "data_sheet.mtbf" not in settings


def test_failures_of_a_sheet_are_a_setting_in_its_words():
    sea = load_scenario("jade-bight", **{"data_sheet.mtbf": "50 h", "data_sheet.repair": "2 h"})
    settings = dict(panel_settings.settings_of(sea, sea))
    values = settings["data_sheet.mtbf"]
    assert values == ["5 h", "12.5 h", "25 h", "50 h", "100 h", "200 h", "500 h"]
    assert "failures.uav_rate" not in settings
    told = panel_settings.describe_setting("data_sheet.mtbf", values, sea, "50 h")
    assert told["texts"][0] == "one every 5 h" and told["default"] == 3
    assert told["name"].endswith("grounded for 2 h in the mean")
    made = make_image(sea, ["greedy"], SEED, PORTION, {"data_sheet.mtbf": values})
    (slider,) = made.sliders
    slider.apply(made.arrays, "5 h")
    often = make_image(
        ScenarioSpace.of(sea, **{"data_sheet.mtbf": "5 h"}), ["greedy"], SEED, PORTION
    )
    assert made.arrays["constants"].tobytes() == often.arrays["constants"].tobytes()


def test_where_one_sheet_has_no_failures_the_sides_differ_by_what_follows_from_the_other():
    sea = SMALL_SHEET
    failing = ScenarioSpace.of(sea, **{"data_sheet.mtbf": "10 h", "data_sheet.repair": "1 h"})
    panel = panels._panel_of(sea, failing, "small", ["greedy"], SEED, {})
    baseline, variation = panel.spaces
    settings = dict(panel_settings.settings_of(baseline, variation))
    assert not [key for key, values in settings.items() if values[0] == values[-1]]
    sides = [panel_settings.value_of(variation, key) for key in settings]
    values = dict(zip(settings, sides, strict=True))
    assert ScenarioSpace.of(baseline, **values).failures == failing.failures
    repair = f"failures.uav_repair={failing.failures.uav_repair}"
    assert repair in panel.render()  # commands set it on both sides
    own, ours, theirs = (
        simulate_batch(side, policies.load("greedy"), SEED, 60) for side in (sea, *panel.spaces)
    )
    assert ours.missions.tobytes() == own.missions.tobytes() != theirs.missions.tobytes()
    assert ours.uavs.tobytes() == own.uavs.tobytes()
    assert not ours.operations["failures"].any()


def test_rates_of_nodes_are_told_as_shares_of_those_of_the_sheet():
    sea = load_scenario("jade-bight")
    rates = ["2 MB/h", "4 MB/h"] + ["3 MB/h"] * (len(sea.nodes) - 2)
    space = ScenarioSpace.of(sea, **{"data_sheet.data_rate": rates})
    values = dict(panel_settings.settings_of(space, space))["data_sheet.data_rate"]
    told = panel_settings.describe_setting("data_sheet.data_rate", values, space, None)
    assert told["texts"][:2] == ["0.25 times the sheet's", "0.5 times the sheet's"]
    assert values[0][:2] == ["0.5 MB/h", "1 MB/h"]


def test_the_prices_of_a_year_can_be_changed():
    space = load_scenario("paper", uavs=2)
    costs = Costs(uav=1000, years=5, interest=0.04, days=250, pack=350)
    panel = str(make_panel(space, space, "paper", ["greedy"], SEED, costs=costs).data)
    assert {"days", "pack", "pack_cycles"} <= {*re.findall('name="price-([a-z_]+)"', panel)}
    assert "UAVs and pads are paid off over 5 years at 4 % interest" in panel
    assert '"unit": "EUR a year"' in panel


@pytest.mark.parametrize("policy", ["greedy", "planner"])
def test_the_grid_says_whose_answer_the_page_has(policy):
    """Where the panel cannot simulate its policy, and why the grid may have another one."""
    space, required = load_scenario("paper", uavs=2, pads=1), Requirement(metric_of(PRODUCT), 0.7)
    rule = rule_of_search(tolerance=0.01, indifference=500)
    search = Search(policy=policy, fleet="3 UAVs, 2 pads", rule=rule)
    about = {"costs": Costs(uav=1000), "requirements": [required], "search": search}
    varied = {"uavs": [1, 2], "pads": [1]}
    panel = str(make_panel(space, space, "paper", [policy], SEED, varied=varied, **about).data)
    assert f"The answer of the page is 3 UAVs, 2 pads with {policy}" in panel
    assert ("which this page cannot simulate" in panel) == (policy == "planner")
    assert '"tolerance": 0.01' in panel and '"indifference": 500' in panel


@pytest.mark.parametrize("name", ["paper", "bay", "jade-bight"])
def test_the_settings_begin_with_those_of_the_scenario(name):
    """Where they stand at first, they change no byte of the arrays."""
    space = load_scenario(name)
    settings = dict(panel_settings.settings_of(space, space))
    assert len(settings) >= 3
    image = make_image(space, ["greedy"], SEED, PORTION, settings)
    for slider in image.sliders:
        changed = copy_inputs(image.arrays)
        slider.apply(changed, panel_settings.value_of(space, slider.setting))
        for array, content in changed.items():
            assert content.tobytes() == image.arrays[array].tobytes(), (slider.setting, array)


@pytest.mark.parametrize(
    "baseline, variation",
    [
        ({"initial_data": 5}, {"initial_data": [5, 20]}),
        ({"wind.strength": 0.0}, {"wind.strength": 1.0}),
        ({"zone": [26, 2, 4, 4]}, {"zone": [2, 2, 4, 4]}),
        ({"nodes": [[3, 3], [9, 9]]}, {"nodes": [[3, 3]]}),
        ({"landing": False}, {"landing": True, "quota": 0}),
        ({"fleet": []}, {"fleet": [{"rate": 2.0}]}),
        ({}, {"data_sheet": {"slot": "20 s", "endurance": "30 min", "data_rate": "1 MB/h"}}),
    ],
)
def test_any_variation_has_a_panel_or_a_sentence(baseline, variation):
    try:
        sides = [load_scenario("paper", **values) for values in (baseline, variation)]
    except InputError:  # of the data sheet, whose fields are another subject
        return
    made = make_panel(*sides, "paper", ["greedy"], SEED).data
    assert 'id="panel"' in made or "cannot simulate by itself" in made


def test_a_panel_says_that_it_has_no_requirements_of_the_worst_node():
    """A fleet that keeps only the others would be called right."""
    space = SMALL_SHEET
    required = [Requirement(metric_of(name), 0.5) for name in ("success", "least")]
    panel = str(make_panel(space, space, "small", ["greedy"], SEED, requirements=required).data)
    assert "since it does not know what is collected of each node" in panel
    assert '<option value="success" selected>' not in panel
    panel = str(make_panel(space, space, "small", ["greedy"], SEED, requirements=required[:1]).data)
    assert '<option value="success" selected>' in panel


def test_what_cannot_be_simulated_in_a_page_is_a_sentence():
    space = load_scenario("paper", arrivals={"process": "continuous"})
    assert "continuous time" in make_panel(space, space, "paper", ["greedy"], SEED).data


@pytest.mark.slow
@pytest.mark.brief
@pytest.mark.parametrize(
    ("policy", "words"),
    [
        ("script-src 'unsafe-inline'", "WebAssembly"),
        (
            "script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src 'none'",
            "workers cannot start",
        ),
    ],
)
def test_a_page_says_when_it_is_forbidden_to_simulate(document, tmp_path, visit, policy, words):
    """By a server's Content-Security-Policy, which adds to that of the page."""
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    path = tmp_path / "page.html"
    path.write_text(document.read_text("utf-8").replace("<head>", f"<head>{meta}", 1), "utf-8")
    tab: Tab = visit(path, 1280).page
    if "workers" in words:
        tab.locator("#panel[data-ready=yes]").wait_for()
        tab.locator("[data-panel=run]").click()
    line = tab.locator("#panel", has_text="This page cannot simulate missions here: ")
    line.filter(has_text=words).wait_for(timeout=PATIENCE)
    assert "A copy of the page that you save and open as a file" in line.inner_text()


def test_a_panel_that_nobody_changed_is_found_sound(document):
    checks = {check.what: check for check in verify_page(document, 1, 0)}
    assert checks["panel"].compared == CHECKED
    assert not any(check.differing for check in checks.values())


@pytest.mark.parametrize("part", ["module", "image", "data"])
def test_a_changed_bit_of_module_arrays_or_hashes_is_found(document, tmp_path, part):
    """Though the checksum of the page was made anew."""
    text = document.read_text("utf-8")
    begin = text.index(">", text.index(f'id="panel-{part}"')) + 1
    at = text.index("hashes", begin) + 20 if part == "data" else begin + 400
    changed = text[:at] + ("0" if text[at] != "0" else "1") + text[at + 1 :]
    path = tmp_path / "page.html"
    path.write_text(Page(changed).sealed.text, "utf-8")
    checks = {check.what: check.differing for check in verify_page(path, 1, 0)}
    assert checks["page"] == []
    assert len(checks["panel"]) == 1


def test_a_panel_may_be_compressed_in_another_way(document, tmp_path):
    """Other versions of zlib find other bytes for the same content."""
    text = document.read_text("utf-8")
    packed = re.search('id="panel-module" type="text/plain">([^<]*)<', text)[1]
    fast = b64encode(gzip.compress(gzip.decompress(b64decode(packed)), 1)).decode()
    assert fast != packed
    path = tmp_path / "page.html"
    path.write_text(Page(text.replace(packed, fast)).sealed.text, "utf-8")
    assert not any(check.differing for check in verify_page(path, 1, 0))


def test_the_missions_of_a_panel_of_another_version_are_checked(document, tmp_path):
    text = document.read_text("utf-8")
    hidden = re.search(f'class="{PANEL}"[^>]*>(.*?)</script>', text, re.S)
    about = json.loads(hidden[1]) | {"module": "0" * 64}
    text = text.replace(hidden[1], json.dumps(about))
    digest = re.search('"hashes": ."([0-9a-f]{64})', text)[1]
    for content, count in ((text, 0), (text.replace(digest, digest[::-1]), 1)):
        path = tmp_path / "page.html"
        path.write_text(Page(content).sealed.text, "utf-8")
        (check,) = (check for check in verify_page(path, 1, 0) if check.what == "panel")
        assert len(check.notes) == 1
        assert len(check.differing) == count


def run(tab: Tab, missions: int = MISSIONS) -> str:
    """Run the missions, and return what the panel says of them."""
    tab.locator("[name=missions]").fill(str(missions))
    tab.get_by_role("button", name="Run", exact=True).click()
    status = tab.locator("[data-panel=status]")
    status.get_by_text(re.compile(r"in [\d.]+ s\.")).wait_for(timeout=PATIENCE)
    return str(status.text_content())


def cells_of(tab: Tab, name: str) -> list[str]:
    """What the panel shows of a metric: A, B, their difference, and whether it is decided."""
    row = tab.locator("#panel tbody tr").filter(
        has=tab.get_by_role("rowheader", name=name, exact=True)
    )
    return [str(text) for text in row.locator("td").all_text_contents()]


def means_of(uavs: int, policy: str = "greedy", **values: Any) -> dict[str, float]:
    records = simulate_batch(
        load_scenario("paper", uavs=uavs, **values), policies.load(policy), SEED, MISSIONS
    )
    return {metric: float(np.mean(records.missions[metric])) for metric in (*METRICS, HOME)}


def test_the_page_simulates_what_python_does(visit, document):
    """Its means are those of Python to the last digit, and its records to the last bit."""
    opened = visit(document, 1280)
    said = run(opened.page)
    assert f"{MISSIONS} of {MISSIONS} missions of A and of B" in said
    assert (
        f"first {CHECKED} missions of the page's baseline are the same as those of Python" in said
    )
    for metric in (*METRICS, HOME):
        shown = cells_of(opened.page, metric_of(metric).name)
        for cell, uavs in zip(shown, (1, 2), strict=False):
            assert cell.startswith(f"{100 * means_of(uavs)[metric]:.1f} % [")
    product = cells_of(opened.page, metric_of("collection_ratio_and_communication").name)
    assert product[2].startswith("+") and product[3].startswith("decided: B is higher")
    command = opened.page.locator("[data-panel=command]").text_content()
    assert command == (
        "dess what-if --baseline uavs=1 --set uavs=2 --policy greedy --scenario paper "
        f"--seed {SEED} --missions {MISSIONS} --price uav=1000 --price pad=300 --price charge=40 "
        "--price hour=0 --price missions=1 --price currency=EUR"
    )
    assert opened.complaints == []
    assert [url for url in opened.requests if not url.startswith("blob:")] == [document.as_uri()]


def test_the_page_flies_with_the_trained_policy_of_its_answer(visit, tmp_path):
    """Its missions are those of Python, and its grid has the fleet of the search."""
    space, required = load_scenario("paper", uavs=2, pads=1), Requirement(metric_of(PRODUCT), 0.7)
    search = Search(policy=NETWORK, fleet="2 UAVs and 1 pad", rule=RULE)
    about = {"costs": PRICES, "requirements": [required], "search": search}
    varied = {"uavs": [1, 2], "pads": [1]}
    panel = make_panel(space, space, "paper", [NETWORK], SEED, varied=varied, **about)
    assert "which this page cannot simulate" not in panel.data
    assert panel.data.count('id="panel-network"') == panel.data.count('id="panel-module"') == 1
    shown = {"title": "A panel", "outcome": "", "library": "", "player": panel.data}
    path = tmp_path / "page.html"
    path.write_text(fill_page("mission.html", simulates=True, **shown), "utf-8")
    opened = visit(path, 390)
    tab = opened.page
    assert tab.locator("[name=a-policy]").input_value() == NETWORK
    tab.locator("summary", has_text="Settings").press("Enter")
    tab.locator("[name=b-policy]").select_option("greedy")
    said = run(tab)
    assert f"first {CHECKED} missions of the page's baseline are the same as those of Py" in said
    mean = 100 * means_of(2, NETWORK, pads=1)[PRODUCT]
    assert cells_of(tab, metric_of(PRODUCT).name)[0].startswith(f"{mean:.1f} % [")
    assert "The cheapest is 2 UAVs, 1 pad" in str(fill_grid(tab).text_content())
    tab.get_by_role("button", name="worst of B").click()
    commands = str(tab.locator("[data-panel=mission-command]").text_content())
    assert re.findall(r"--policy (\w+)", commands) == [NETWORK, "greedy"]
    assert opened.complaints == []


def test_what_is_decided_but_for_a_rare_failure_is_so_in_what_was_seen(visit, document):
    """As the verdict of a study: its words, and its rule with intervals that may be watched."""
    few = 30
    sides = [
        simulate_batch(load_scenario("paper", uavs=uavs), policies.load("greedy"), SEED, few)
        for uavs in (1, 2)
    ]
    tab = visit(document, 1280).page
    run(tab, few)
    verdicts = set()
    for metric in METRICS:
        before, after = (records.missions[metric].astype(float) for records in sides)
        bound = 1.0 if metric_of(metric).is_bounded else np.inf
        sequence = new_sequence(-bound, bound, failure=metric_of(metric).failure)
        add_values(sequence, after - before)
        low, high = sequence_ends(sequence)
        whole = position_of(Interval(0.0, low, high))
        without = position_of(Interval(0.0, *ends_of_what_was_seen(sequence)))
        verdict = position_with_allowance(whole, without)
        if metric_of(metric).is_outcome:
            verdict = whole
        said = cells_of(tab, metric_of(metric).name)[3]
        verdicts.add(verdict)
        assert said.startswith(SAID[verdict]), metric
        assert (NOT_RULED_OUT in said) == (verdict == SEEN_ABOVE), metric
    assert SEEN_ABOVE in verdicts


def test_what_is_neither_better_nor_worse_is_not_called_so(visit, tmp_path):
    """Requests for a pad and the utilisation are decided, and no more; they are not required."""
    baseline, variation = (
        load_scenario("paper", uavs=uavs, pads=2, charging={"measured": True}) for uavs in (1, 3)
    )
    costs = Costs(uav=1000, charge=40, years=5, interest=0.04, days=250, pack=350)
    panel = make_panel(baseline, variation, "paper", ["greedy"], SEED, costs=costs)
    shown = {"title": "A panel", "outcome": "", "library": "", "player": panel.data}
    path = tmp_path / "page.html"
    path.write_text(fill_page("mission.html", simulates=True, **shown), "utf-8")
    tab = visit(path, 1280).page
    missions = 400
    run(tab, missions)
    for name in ("pad_requests", "utilisation"):
        assert cells_of(tab, metric_of(name).name)[3] == "decided: B is higher"
        assert tab.locator(f"[name=require-0] option[value={name}]").count() == 0
    assert cells_of(tab, metric_of("queue").name)[3].endswith("worse")
    cost = cells_of(tab, "Cost")[0]
    records = simulate_batch(baseline, policies.load("greedy"), SEED, missions)
    left = records.uavs["battery"][:, 0] - records.uavs["charged"][:, 0]
    spent = records.missions["flying_time"] - left
    annuity = 0.04 / (1 - 1.04**-5)
    running = 250 * (350 / 300 + 40) * spent.mean() / 100
    losses = 250 * 1000 * records.uavs["down"][:, 0].mean()
    assert cost.startswith(f"{1000 * annuity + running + losses:,.0f} EUR a year [")


def test_a_reader_changes_settings_with_the_keyboard(visit, document):
    tab = visit(document, 390).page
    tab.locator("#panel summary").first.press("Enter")  # on a narrow screen, settings are folded
    tab.locator("[name=b-policy]").select_option("nearest")
    tab.locator("[name=b-uavs]").press("Home")
    run(tab)
    shown = cells_of(tab, metric_of("collection_ratio").name)
    assert shown[1].startswith(f"{100 * means_of(1, 'nearest')['collection_ratio']:.1f} % [")
    command = tab.locator("[data-panel=command]").text_content()
    assert "dess sweep --set uavs=1 --policy greedy,nearest" in command
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_mission_is_played_on_both_sides(visit, document):
    """It ends after as many slots as in Python, with as much data left."""
    tab = visit(document, 390).page
    run(tab)
    tab.get_by_role("button", name="worst of B").click()
    (number,) = re.findall(
        r"Mission (\d+):", str(tab.locator("[data-panel=mission-text]").text_content())
    )
    for side, uavs in (("a", 1), ("b", 2)):
        record = simulate_batch(
            load_scenario("paper", uavs=uavs), policies.load("greedy"), SEED, [int(number)]
        ).missions[0]
        player = tab.locator(f"#panel-player-{side}")
        player.locator("canvas").press("End")
        told = str(player.locator("output").text_content())
        assert told.startswith(f"slot {record['slots']} of {record['slots']} · ")
        left = float(re.search(r"· ([\d.,]+) data units left", told)[1].replace(",", ""))
        assert left == pytest.approx(record["residual"], rel=0.01)
    command = str(tab.locator("[data-panel=mission-command]").text_content())
    assert f"--set uavs=1 --seed {SEED} --replication {number}" in command
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_typical_mission_has_the_median_difference(visit, document):
    tab = visit(document, 1280).page
    run(tab)
    differences = np.subtract(
        *[
            simulate_batch(
                load_scenario("paper", uavs=uavs), policies.load("greedy"), SEED, MISSIONS
            ).missions[PRODUCT]
            for uavs in (2, 1)
        ]
    )
    shown = tab.locator("[data-panel=mission-text]")
    for kind, rank in (("typical mission", (MISSIONS - 1) // 2), ("largest loss", 0)):
        tab.get_by_role("button", name=kind).click()
        (number,) = re.findall(r"Mission (\d+):", str(shown.text_content()))
        assert differences[int(number)] == np.sort(differences)[rank]


def test_a_mission_that_differs_is_named(visit, document, tmp_path):
    """As if the module simulated something else than Python did."""
    text = document.read_text("utf-8")
    digests = re.search(r'"hashes": \[([^\]]*)\]', text)[1].split(", ")
    swapped = ", ".join([digests[0], digests[2], digests[1], *digests[3:]])
    path = tmp_path / "page.html"
    path.write_text(text.replace(", ".join(digests), swapped), "utf-8")
    assert "Mission 1 of the page's baseline differs" in run(visit(path, 1280).page)


def test_prices_are_changed(visit, document):
    tab = visit(document, 1280).page
    tab.get_by_text("Prices [EUR]").click()
    tab.get_by_label("A UAV", exact=True).fill("2500")
    run(tab)
    for cell, uavs in zip(cells_of(tab, "Cost"), (1, 2), strict=False):
        space = load_scenario("paper", uavs=uavs)
        records = simulate_batch(space, policies.load("greedy"), SEED, MISSIONS)
        charging = 40 * records.uavs["charged"].sum(axis=1).mean() / 100
        assert cell.startswith(f"{2500 * uavs + 300 * 16 + charging:,.0f} EUR [")
    tab.locator("[name=b-policy]").select_option("tour")
    what_if = str(tab.locator("[data-panel=command]").text_content())
    assert " --policy greedy --policy tour " in what_if and "--price uav=2500 " in what_if
    tab.locator("[name=b-policy]").select_option("greedy")
    tab.locator("[name=a-uavs]").press("ArrowRight")
    sweep = str(tab.locator("[data-panel=command]").text_content())
    assert sweep.startswith("dess sweep --set uavs=2 ") and "--price uav=2500 " in sweep


def test_numbers_of_other_settings_are_said_to_be_so(visit, document):
    tab = visit(document, 1280).page
    run(tab)
    tab.get_by_role("button", name="worst of B").click()
    tab.locator("[name=a-uavs]").press("End")
    assert "of the settings before" in str(tab.locator("[data-panel=status]").text_content())
    run(tab)
    assert tab.locator("[data-panel=mission]").is_hidden()


def test_what_is_saved_of_a_run_is_of_its_own_settings(visit, document):
    """CSV and players are those of the run, whatever has been moved since; a requirement may be."""
    tab = visit(document, 1280).page
    run(tab)
    command = str(tab.locator("[data-panel=command]").text_content())
    tab.locator("[name=a-uavs]").press("End")
    tab.locator("[name=require-0]").select_option("collection_ratio")
    assert "of the settings before" in str(tab.locator("[data-panel=status]").text_content())
    assert tab.locator("[data-panel=before]").is_visible()
    assert str(tab.locator("[data-panel=command]").text_content()) != command
    with tab.expect_download() as saved:
        tab.get_by_role("button", name="Save the missions as CSV").click()
    assert Path(saved.value.path()).read_text("utf-8").split("\n")[1] == f"# {command}"
    tab.locator("[name=a-uavs]").press("Home")
    assert tab.locator("[data-panel=before]").is_hidden()


def test_commands_name_the_file_of_a_sea_and_what_was_set(visit, tmp_path):
    """Not its cells; a policy beside another one is a sweep, which has a page."""
    given = {"uavs": 2, "data_sheet.data_rate": "6 MB/h"}
    space = load_scenario("jade-bight", **given)
    panel = make_panel(space, space, "/home/me/my-sea.toml", ["greedy"], SEED, given=given)
    shown = {"title": "A panel", "outcome": "", "library": "", "player": panel.data}
    path = tmp_path / "page.html"
    path.write_text(fill_page("mission.html", simulates=True, **shown), "utf-8")
    tab = visit(path, 390).page
    tab.locator("summary", has_text="Settings").click()
    tab.locator("[name=b-policy]").select_option("tour")
    assert "/home" not in str(panel.data)
    assert str(tab.locator("[data-panel=command]").text_content()) == (
        "dess sweep --set uavs=2 --set 'data_sheet.data_rate=\"6 MB/h\"' --policy greedy,tour "
        f"--scenario my-sea.toml --seed {SEED} --missions 1000"
    )
    assert "my-sea.toml is the file" in tab.locator("#panel").inner_text()
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_requirement_is_judged_by_the_intervals(visit, document):
    """It may be changed without new missions: an interval is on one side of it, or around it."""
    tab = visit(document, 390).page
    run(tab)
    tab.locator("[name=require-0]").select_option("collection_ratio")
    ends = [
        [float(end) for end in re.search(r"\[(.*), (.*)\]", cell).groups()]
        for cell in cells_of(tab, metric_of("collection_ratio").name)[:2]
    ]
    for bound in (ends[0][0] - 1, sum(ends[0]) / 2, ends[0][1] + 1, ends[1][1] + 1):
        tab.locator("[name=bound-0]").fill(str(bound))
        words = [
            "met" if low > bound else "missed" if high < bound else "open" for low, high in ends
        ]
        marks = tab.locator("[data-panel=verdicts] strong").all_text_contents()
        assert marks == words
    assert "of the settings before" not in str(tab.locator("[data-panel=status]").text_content())


def test_a_becomes_b_and_all_is_as_before(visit, document):
    tab = visit(document, 1280).page
    values = {
        name: tab.locator(f"[name={name}]").input_value()
        for name in ("a-uavs", "b-uavs", "a-policy", "b-policy", "require-0", "price-uav")
    }
    tab.locator("[name=a-uavs]").press("End")
    tab.locator("[name=a-policy]").select_option("tour")
    tab.locator("[name=require-0]").select_option("success")
    tab.get_by_role("button", name="Copy A to B").click()
    for name in ("uavs", "policy"):
        sides = [tab.locator(f"[name={side}-{name}]").input_value() for side in "ab"]
        assert sides[0] == sides[1]
    tab.get_by_role("button", name="Reset").click()
    for name, value in values.items():
        assert tab.locator(f"[name={name}]").input_value() == value


def test_runs_are_listed_and_any_two_are_compared(visit, document):
    """With the keyboard; each is shown as it was, and a moved slider marks what is shown."""
    opened = visit(document, 390)
    tab = opened.page
    run(tab, 60)
    first = cells_of(tab, metric_of(PRODUCT).name)
    tab.locator("#panel summary").first.press("Enter")
    tab.locator("[name=b-uavs]").press("End")
    tab.locator("[name=price-uav]").evaluate("input => { input.value = 2000; }")
    run(tab, 40)
    listed = tab.locator("[data-panel=run-rows] tr")
    rows = [row.locator("td").all_text_contents() for row in listed.all()]
    assert [(changes, missions) for changes, missions, _ in rows] == [
        ("nothing", "60"),
        ("Number of UAVs 1 → 2", "60"),
        ("A UAV 2,000", "40"),
        ("Number of UAVs 1 → 8; A UAV 2,000", "40"),
    ]
    assert rows[0][2].startswith(f"Product {first[0]}; Cost ")
    buttons = tab.locator("[data-panel=run-rows] button")
    buttons.nth(1).press("Enter")
    assert cells_of(tab, metric_of(PRODUCT).name) == [first[1], "the same as A", "", ""]
    assert tab.locator("[name=a-uavs]").input_value() == "1"
    assert tab.locator("[name=price-uav]").input_value() == "1000"
    buttons.nth(0).press("Space")
    swapped = cells_of(tab, metric_of(PRODUCT).name)
    assert swapped[:2] == first[1::-1]
    assert swapped[2].startswith(first[2].partition(" ")[0].replace("+", "−"))
    pressed = [button.get_attribute("aria-pressed") for button in buttons.all()]
    assert pressed == ["true", "true", "false", "false"]
    assert buttons.all_text_contents() == ["Run 1: B", "Run 2: A", "Run 3", "Run 4"]
    assert tab.locator("[data-panel=before]").is_hidden()
    tab.locator("[name=a-uavs]").press("End")
    assert tab.locator("[data-panel=before]").is_visible()
    buttons.nth(0).press("Enter")
    assert tab.locator("[data-panel=before]").is_hidden()
    assert "same as those of Python" in str(tab.locator("[data-panel=status]").text_content())
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.complaints == []


def test_a_run_goes_on_where_it_ended(visit, document):
    """Its missions are not simulated twice: those of A are there when only B has changed."""
    tab = visit(document, 1280).page
    run(tab, 40)
    run(tab, 90)
    counts = tab.locator("[data-panel=run-rows] tr td:nth-child(3)")
    assert counts.all_text_contents() == ["90", "90"]
    records = simulate_batch(load_scenario("paper", uavs=1), policies.load("greedy"), SEED, 90)
    mean = 100 * records.missions[PRODUCT].mean()
    assert cells_of(tab, metric_of(PRODUCT).name)[0].startswith(f"{mean:.1f} % [")


def rule_of_search(**values: Any) -> Cheapest:
    return Cheapest(procedure="cheapest", requirements={PRODUCT: 0.7}, **values)


RULE = rule_of_search(indifference=10, first=30, budget=800)
PRICES = Costs(uav=1000, pad=300)


@pytest.fixture(scope="module")
def searched(tmp_path_factory) -> Path:
    """A page with the panel of a search for the cheapest fleet."""
    space, required = load_scenario("paper", uavs=2, pads=1), Requirement(metric_of(PRODUCT), 0.7)
    fleets = {"uavs": [1, 2], "pads": [1, 4]}
    search = Search(policy="greedy", fleet="2 UAVs and 1 pad", rule=RULE)
    about = {"costs": PRICES, "requirements": [required], "varied": fleets, "search": search}
    given = {"uavs": 2, "pads": 1}
    panel = make_panel(space, space, "paper", ["greedy"], SEED, given=given, **about)
    shown = {"title": "A panel", "outcome": "", "library": "", "player": panel.data}
    path = tmp_path_factory.mktemp("panel") / "page.html"
    path.write_text(fill_page("mission.html", simulates=True, **shown), "utf-8")
    return path


def fill_grid(tab: Tab) -> Locator:
    """Fill the grid, and return the line of its state."""
    tab.get_by_role("button", name="Fill the grid").click()
    status = tab.locator("[data-panel=grid-status]")
    status.get_by_text(re.compile(r"\d missions\.$")).wait_for(timeout=PATIENCE)
    return status


def grid_of(tab: Tab) -> dict[tuple[int, int], tuple[str, str]]:
    """The look of each cell of the buyer's grid and its text, by UAVs and pads."""
    rows = tab.locator(".grid tbody tr").all()
    return {
        (uavs, pads): (str(cell.get_attribute("class")), cell.inner_text())
        for pads, row in zip((1, 4), rows, strict=True)
        for uavs, cell in zip((1, 2), row.locator("td").all(), strict=True)
    }


def test_the_grid_says_what_is_known_of_each_fleet(visit, searched):
    """Its intervals are those of Python, for all cells together, and hold for other bounds."""
    opened = visit(searched, 1280)
    tab = opened.page
    status = fill_grid(tab)
    assert tab.locator("[data-panel=grid-bar]").evaluate("bar => bar.value") == 1
    grid = grid_of(tab)
    assert {fleet: look for fleet, (look, _) in grid.items()} == {
        (1, 1): "missed",
        (1, 4): "missed",
        (2, 1): "met cheapest",
        (2, 4): "open",  # it costs more than one that meets the requirements
    }
    assert "30 missions" in grid[2, 4][1]
    ends = {}
    samples = {}
    for (uavs, pads), (_, text) in grid.items():
        count = int(re.search(r"(\d+) missions", text)[1])
        space = load_scenario("paper", uavs=uavs, pads=pads)
        records = simulate_batch(space, policies.load("greedy"), SEED, count)
        products = records.missions[PRODUCT]
        samples[uavs, pads] = {PRODUCT: products, "cost": np.full(count, 1000 * uavs + 300 * pads)}
        sequence = new_sequence(0, 1, 0.05 / (2 * len(grid)))  # an interval of the cost as well
        add_values(sequence, products)
        low, high = ends[uavs, pads] = sequence_ends(sequence)
        assert f"[{100 * low:.1f}, {100 * high:.1f}]" in text
    settings = [Setting({"uavs": uavs, "pads": pads}, 0.0) for uavs, pads in samples]
    choice = RULE.choice([*samples.values()], settings)
    assert [[*samples][point] for point in choice.selected] == [(2, 1)]
    for sample, count in zip(samples.values(), choice.counts, strict=True):
        rounds = [RULE.first]
        while rounds[-1] < len(sample[PRODUCT]):
            rounds.append(rounds[-1] + int(GROWTH * rounds[-1]))
        assert count <= len(sample[PRODUCT]) == rounds[-1]
    before = str(status.text_content())
    assert "The cheapest is 2 UAVs, 1 pad for 2,300 EUR" in before
    tab.locator("[name=bound-0]").fill(str(100 * np.mean(ends[1, 1])))  # no one knows
    said = str(status.text_content())
    assert "The cheapest so far is 2 UAVs, 1 pad for 2,300 EUR. Open: 1 UAV, 1 pad; " in said
    assert re.search(r"To settle it would take about [\d,]+ more missions\.", said)
    assert 0 < tab.locator("[data-panel=grid-bar]").evaluate("bar => bar.value") < 1
    command = str(tab.locator("[data-panel=fill-command]").text_content())
    assert (
        "dess sweep --policy greedy --set uavs=1,2 --set pads=1,4 --require product=0." in command
    )
    with tab.expect_download() as saved:
        tab.get_by_role("button", name="Save CSV").click()
    lines = Path(saved.value.path()).read_text("utf-8").splitlines()
    assert lines[0] == "# exploration, not verified"
    assert lines[1] == f"# {command}"
    assert len(lines) == 3 + len(grid)
    looks = {fleet: look for fleet, (look, _) in grid_of(tab).items()}
    assert (looks[1, 1], looks[2, 1]) == ("open", "met leading")
    tab.locator("[name=bound-0]").fill("20")
    assert "The cheapest is 1 UAV, 1 pad for 1,300 EUR" in str(status.text_content())
    tab.locator("[name=a-max_slots]").press("Home")
    assert "of the settings before" in str(status.text_content())
    assert opened.complaints == []


def test_the_grid_is_stopped_and_goes_on(visit, searched):
    tab = visit(searched, 390).page
    tab.locator("[name=bound-0]").fill("58.5")  # too near to the mean of one UAV
    tab.get_by_role("button", name="Fill the grid").click()
    status = tab.locator("[data-panel=grid-status]")
    status.get_by_text(re.compile(r"[1-9]\d* missions, running")).wait_for(timeout=PATIENCE)
    tab.get_by_role("button", name="Stop").first.click()
    (stopped,) = re.findall(r"([\d,]+) missions\.$", str(status.text_content()))
    assert int(stopped.replace(",", "")) < RULE.budget
    said = str(fill_grid(tab).text_content())
    (ended,) = re.findall(r"([\d,]+) missions\.$", said)
    assert RULE.budget - len(grid_of(tab)) < int(ended.replace(",", "")) <= RULE.budget
    assert "Open: 1 UAV, 1 pad" in said
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390


# Before the scripts of a page: keeps the texts that it draws.
KEEP_TEXTS = """window.drawn = [];
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
    window.drawn.push(text);
    fill.call(this, text, ...place);
};"""


def test_what_is_saved_says_that_it_is_exploration(visit, document):
    """Pictures and CSV, whose missions are those of Python."""
    tab = visit(document, 1280).page
    tab.add_init_script(KEEP_TEXTS)
    tab.reload()
    run(tab)
    assert "exploration, not verified" in tab.evaluate("window.drawn")
    tab.evaluate("window.drawn = []")
    tab.get_by_role("button", name="worst of B").click()
    assert tab.evaluate("window.drawn").count("exploration, not verified") >= 2
    with tab.expect_download() as saved:
        tab.get_by_role("button", name="Save the missions as CSV").click()
    text = Path(saved.value.path()).read_text("utf-8")
    assert text.startswith("# exploration, not verified\n# dess what-if ")
    table = pd.read_csv(io.StringIO(text), comment="#")
    for side, uavs in (("a", 1), ("b", 2)):
        records = simulate_batch(
            load_scenario("paper", uavs=uavs), policies.load("greedy"), SEED, MISSIONS
        )
        assert np.array_equal(table[f"{PRODUCT}_{side}"], records.missions[PRODUCT])
    with tab.expect_download() as saved:
        tab.get_by_role("button", name="Save picture").click()
    assert Path(saved.value.path()).read_bytes().startswith(b"\x89PNG")


def test_another_mission_is_played(visit, tmp_path):
    """It is the one of Python: the page compares its records, and ends after as many slots."""
    space = load_scenario("paper", uavs=2)
    shown = {"title": "Another", "outcome": "", "library": player_script().data}
    shown["player"] = make_another(space, "paper", ["ddqn"], SEED, {"uavs": 2}).data
    path = tmp_path / "page.html"
    path.write_text(fill_page("mission.html", scripts=True, simulates=True, **shown), "utf-8")
    assert not any(check.differing for check in verify_page(path, 1, 0))
    opened = visit(path, 390)
    tab = opened.page
    tab.locator("[name=number]").fill("5")
    tab.get_by_role("button", name="Show the next one").click()
    status = tab.locator("[data-panel=status]")
    assert "same as that of Python, bit for bit" in str(status.text_content())
    tab.locator("[name=a-uavs]").press("ArrowRight")
    tab.get_by_role("button", name="Show this mission").click()
    record = simulate_batch(
        load_scenario("paper", uavs=3), policies.load("greedy"), SEED, [6]
    ).missions[0]
    assert f"collection ratio {100 * record['collection_ratio']:.1f} %" in str(
        status.text_content()
    )
    assert tab.locator("[data-panel=before]").is_hidden()
    assert f"of {record['slots']} · " in str(tab.locator("#another output").last.text_content())
    command = str(tab.locator("[data-panel=command]").text_content())
    assert command == (
        f"dess simulate --policy greedy --scenario paper --set uavs=3 --seed {SEED} --replication 6"
    )
    tab.locator("[name=a-uavs]").press("ArrowRight")
    assert "of the settings before" in tab.locator("[data-panel=before]").inner_text()
    assert str(tab.locator("[data-panel=command]").text_content()) == command
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.complaints == []


def test_the_index_simulates_its_example(visit, tmp_path):
    """As Python does: the paper's sea with three UAVs, and with as many as the reader chooses."""
    path = tmp_path / "index.html"
    path.write_text(make_index({}), "utf-8")
    opened = visit(path, 390)
    tab = opened.page
    tab.locator("[name=b-uavs]:enabled").press("Home")  # it waits for the module
    tab.get_by_role("button", name="Run", exact=True).click()
    done = re.compile(r"^1,000 missions of each\.")
    tab.locator("[data-panel=status]").get_by_text(done).wait_for(timeout=PATIENCE)
    column = METRICS_OF_MODULE.index(PRODUCT)
    cells = tab.locator(f"tr[data-metric='{column}'] td").all_text_contents()
    for cell, uavs in zip(cells, (3, 1), strict=False):
        space = load_scenario("paper", uavs=uavs)
        mean = simulate_batch(space, policies.load("greedy"), 0, 1000).missions[PRODUCT].mean()
        assert cell.startswith(f"{100 * mean:.1f} % [")
    assert cells[3].startswith("decided: B is lower")
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.complaints == []


def test_an_index_has_no_example_of_another_version(monkeypatch, tmp_path):
    assert 'id="try"' in make_index({})
    example = json.loads(index.EXAMPLE.read_text("utf-8"))
    monkeypatch.setattr(index, "EXAMPLE", tmp_path / "example.json")
    index.EXAMPLE.write_text(json.dumps(example | {"module": "0" * 64}), "utf-8")
    assert 'id="try"' not in make_index({})


def test_missions_are_stopped(visit, document):
    tab = visit(document, 1280).page
    tab.locator("[name=missions]").fill("100000")
    tab.get_by_role("button", name="Run", exact=True).click()
    tab.locator("[data-panel=status]").get_by_text("running").wait_for(timeout=PATIENCE)
    tab.get_by_role("button", name="Stop").click()
    assert "stopped" in str(tab.locator("[data-panel=status]").text_content())
    assert tab.get_by_role("button", name="Run", exact=True).is_enabled()


def test_the_address_is_text_of_strangers(visit, document, tmp_path):
    """Known names and positions within their limits count, and nothing else."""
    address = "a-uavs=3&b-policy=tour&missions=77&b-uavs=99&a-policy=<img src=x>&c-uavs=1&a-pads=-1"
    address += "&require-0=home&bound-0=1e9"
    opened = visit(document, 1280)
    tab = opened.page
    tab.goto(f"{document.as_uri()}#{address}")
    tab.reload()
    tab.locator("#panel[data-ready=yes]").wait_for(timeout=PATIENCE)
    assert tab.locator("[name=a-uavs]").input_value() == "3"
    assert tab.locator("[name=b-uavs]").input_value() == "1"
    assert tab.locator("[name=b-policy]").input_value() == "tour"
    assert tab.locator("[name=a-policy]").input_value() == "greedy"
    assert tab.locator("[name=missions]").input_value() == "77"
    assert tab.locator("[name=require-0]").input_value() == "home"
    assert tab.locator("[name=bound-0]").input_value() == ""
    assert tab.locator("[data-panel=results]").is_hidden()  # it starts nothing
    assert opened.complaints == []
