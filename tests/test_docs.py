"""The README and the docs: their commands, links, names, snippets and figures hold."""

import json
import re
import shlex
import tomllib
from functools import cache
from pathlib import Path
from textwrap import indent
from typing import Any

import numpy as np
import pandas as pd
import pytest
import typer.main
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import dess
from benchmarks import learning_curves, scale
from dess import load_scenario, policies
from dess.analysis import load_study, numbers
from dess.analysis.paper import values
from dess.model.channel import world_of
from dess.model.events import EVENT_NAMES, EventLog
from dess.model.record import MISSION_RECORD, UAV_RECORD
from dess.reports import cli
from dess.reports.cli import commands, options
from dess.reports.pages import notebook
from docs import hooks, pictures
from tests.outside import install_package

ROOT = Path(__file__).parents[1]
TOP = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")
PATHS = [*(ROOT / name for name in TOP), *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in PATHS}
ALL = "\n".join(PAGES.values())
README, OWN_POLICY = PAGES["README.md"], PAGES["docs/how-to/own-policy.md"]
POLICIES = PAGES["docs/concepts/policies.md"]


def blocks(text: str, language: str) -> list[str]:
    """The fenced blocks of a language; a command on several lines is one line."""
    found = re.findall(rf"^ *```{language}\n(.*?)^ *```", text, re.M | re.S)
    return [join_lines(block) for block in found]


def join_lines(text: str) -> str:
    """A text with commands on one line each, which a backslash breaks."""
    return re.sub(r" \\\n *", " ", text)


def every(language: str) -> list[Any]:
    """The fenced blocks of a language in all pages, as parameters."""
    return [
        pytest.param(block, id=f"{page}-{number}")
        for page, text in PAGES.items()
        for number, block in enumerate(blocks(text, language))
    ]


def command_lines(program: str) -> list[list[str]]:
    """The arguments of every call of a program in a shell block."""
    lines = (line for text in PAGES.values() for b in blocks(text, "sh") for line in b.splitlines())
    parts = (shlex.split(part) for line in lines for part in line.split("&&"))
    return [words[1:] for words in parts if words and Path(words[0]).name == program]


@cache
def whole_command() -> Any:
    """The command ``dess``, which takes a while to put together."""
    return typer.main.get_command(commands.app)


def leaf(arguments: list[str]) -> tuple[Any, list[str]]:
    """The subcommand that arguments name, and those that are left for it."""
    command: Any = whole_command()
    while hasattr(command, "commands"):
        if not arguments and command.invoke_without_command:  # such as dess policies
            break
        assert arguments, "no subcommand"
        name, *arguments = arguments
        assert name in command.commands, f"dess has no command {name}"
        command = command.commands[name]
    return command, arguments


def anchors(path: Path) -> set[str]:
    """What a link can point to inside a page."""
    headings = re.findall(r"^#+ (.+)$", path.read_text("utf-8"), re.M)
    return {re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def table(text: str, heading: str) -> dict[str, list[list[float]]]:
    """The numbers of a table's rows: per cell those in it."""
    rows = text.split(f"| {heading} |", 1)[1].split("\n\n", 1)[0].splitlines()[2:]
    cells = ([cell.strip(" `") for cell in row.strip("|").split("|")] for row in rows)
    return {
        name: [[float(n) for n in re.findall(r"[\d.]+", c)] for c in rest] for name, *rest in cells
    }


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """The policy of the how-to page as an installed package; the name of the policy.

    The working folder has this policy, and the files that pages give a title; a title with a
    folder is that of a file of the repository.
    """
    for title, text in re.findall(r'^```\w+ title="([^/]+?)"\n(.*?)^```', ALL, re.M | re.S):
        (tmp_path / title).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    source = next(block for block in blocks(OWN_POLICY, "python") if "class " in block)
    project = tomllib.loads(blocks(OWN_POLICY, "toml")[0])["project"]
    ((name, where),) = project["entry-points"]["dess.policies"].items()
    module = where.split(":")[0]
    install_package(tmp_path / "my-policies", monkeypatch, module, source, **{name: where})
    return name


# --- commands ---


def test_the_readme_opens_with_four_lines_and_the_two_commands():
    set_up = "python3 -m venv .venv && .venv/bin/pip install nox && .venv/bin/nox -s"
    start, sessions = blocks(README, "sh")[:2]
    assert len(start.splitlines()) == 4 and "dess sweep" in start
    assert sessions == f"{set_up} reports\n{set_up} tests\n"


@pytest.mark.usefixtures("outside")
@pytest.mark.parametrize("arguments", command_lines("dess"), ids=" ".join)
def test_commands_are_accepted(arguments):
    if arguments == ["--version"]:
        assert cli.main(arguments) == 0
        return
    command, rest = leaf(arguments)
    given = command.make_context(command.name, list(rest)).params
    trained = {a[a.index("--out") + 1] for a in command_lines("dess") if a[0] == "train"}
    for team in {*map(str, np.atleast_1d(given.get("policy") or []))} - trained:
        assert policies.load_team(team)
    if arguments[0] == "sweep":
        values = options.parse_all_values(given["settings"])
        assert load_scenario(given["scenario"], **{field: of[0] for field, of in values.items()})
    elif given.get("scenario"):
        assert options.load_space(given["scenario"], given["settings"])
    if arguments[:2] == ["study", "run"]:
        assert all(map(load_study, given["names"]))


def test_commands_in_the_text_exist():
    found = [c for text in PAGES.values() for c in re.findall(r"`(dess [a-z].*?)`", text)]
    assert found
    for text in found:
        leaf(shlex.split(text)[1:])


def test_nox_sessions_exist():
    defined = re.findall(
        r"^@nox\.session.*\ndef (\w+)", (ROOT / "noxfile.py").read_text("utf-8"), re.M
    )
    named = {s for text in PAGES.values() for s in re.findall(r"nox -s (\w+)", text)}
    assert {"tests", "reports"} <= named <= set(defined)


@pytest.mark.slow
@pytest.mark.brief
def test_the_moving_picture_is_of_the_command_beside_it(tmp_path):
    (text,) = re.findall(r"`dess (simulate .*--animation .*?)`", README)
    *arguments, name = shlex.split(text)
    picture = ROOT / name
    assert f'src="{name}"' in README
    assert picture.stat().st_size < 600_000
    assert cli.main([*arguments, str(tmp_path / "again.gif")]) == 0
    with Image.open(picture) as shown, Image.open(tmp_path / "again.gif") as again:
        assert (again.size, again.n_frames) == (shown.size, shown.n_frames)


def test_the_pictures_of_the_model_are_those_of_their_command():
    drawn = dict(pictures.draw_model())
    assert {path.name for path in pictures.MODEL.iterdir()} == {*drawn}
    for name, content in drawn.items():
        is_current = (pictures.MODEL / name).read_bytes() == content
        assert is_current, f"{name} is another one; renew it: python -m docs.pictures"
        assert f"](../model/{name})" in PAGES["docs/concepts/model.md"]


@pytest.mark.slow
def test_the_pictures_of_the_gallery_are_as_new_as_the_pages():
    """Of the look of the pages and, where ``nox -s reports`` has made them, of what they say."""
    assert pictures.outdated(ROOT / "build" / "reports") == [], (
        "renew them: nox -s reports, then python -m docs.pictures build/reports"
    )
    shown = re.findall(r"\]\(gallery/(.*)\.png\)", PAGES["docs/gallery.md"])
    assert sorted(shown) == sorted([*pictures.PAGES, pictures.PANEL])


def test_a_picture_that_is_older_than_its_page_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "GALLERY", tmp_path)
    monkeypatch.setattr(pictures, "finding_of", lambda _: "Two pads are enough.")
    kept = PngInfo()
    kept.add_text(pictures.FINDING, "Two pads are enough.")
    kept.add_text(pictures.LOOKED, pictures.look())
    Image.new("RGB", (2, 2)).save(tmp_path / "mission.png", pnginfo=kept)
    assert pictures.is_current("mission", tmp_path)
    assert not pictures.is_current("learning", tmp_path)
    monkeypatch.setattr(pictures, "finding_of", lambda _: "Three pads are enough.")
    assert not pictures.is_current("mission", tmp_path)
    monkeypatch.setattr(pictures, "finding_of", lambda _: "")
    monkeypatch.setattr(pictures, "look", lambda: "another look")
    assert not pictures.is_current("mission", tmp_path)


def test_the_site_groups_the_how_tos_as_their_page_does():
    nav = (ROOT / "mkdocs.yml").read_text("utf-8").partition("- How-to:")[2]
    in_nav = re.findall(r"^ {6}- ([^:\n]+):$|^ {10}- .*: how-to/(.*)$", nav, re.M)
    on_page = re.findall(r"^\*\*(.*)\*\*$|^- \[.*\]\((.*)\)$", PAGES["docs/how-to/index.md"], re.M)
    assert in_nav == on_page


def test_the_first_page_of_the_site_has_the_start_and_the_results_of_the_readme():
    found = hooks.PART.findall(PAGES["docs/index.md"])
    assert found == [("readme", "Start"), ("readme", "Three results")]
    start, results = (hooks.readme(heading) for _, heading in found)
    assert "pip install" in start and "dess sweep" in start
    assert "](how-to/own-sea.md)" in start and "](source/CONTRIBUTING.md)" in start
    assert len(re.findall(r"^\d\. ", results, re.M)) == 3


def test_the_tutorial_has_a_live_page_where_it_was_rendered(tmp_path, monkeypatch):
    """The site has the rendered reports, but not what failed; without them, the live page."""
    ((_, name),) = hooks.PART.findall(PAGES["docs/tutorial.md"])
    assert name in notebook.NAMES
    monkeypatch.setattr(hooks, "REPORTS", tmp_path / "reports")
    assert f'src="{hooks.LIVE}#try"' in hooks.live(name)
    assert hooks.rendered() == []
    hooks.REPORTS.mkdir()
    for file in (f"{name}.html", f"{name}.ipynb", "mission.partial.html"):
        (hooks.REPORTS / file).write_text("", "utf-8")
    assert f'src="reports/{name}.html#panel"' in hooks.live(name)
    assert {path.name for path in hooks.rendered()} == {f"{name}.html", f"{name}.ipynb"}


# --- links and names ---


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    links = re.findall(r'\]\(([^)\s]+)\)|src="([^"]+)"', PAGES[page])
    for link in filter(None, (a or b for a, b in links)):
        if not link.startswith("https://"):
            name, _, anchor = link.partition("#")
            target = (ROOT / page).parent / name if name else ROOT / page
            assert target.is_file(), link  # the site shows files, and no folders
            assert not anchor or anchor in anchors(target), link


def test_a_clone_shows_no_placeholder_of_the_site():
    assert re.findall(r"^<!-- \[\[ commands \]\] -->$", ALL, re.M)
    assert not re.findall(r"^\[\[ \w.*\]\]$", ALL, re.M)


@pytest.mark.parametrize("page", PAGES)
def test_tests_that_are_named_exist(page):
    sources = "".join(path.read_text("utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    defined = set(re.findall(r"^def (test_\w+)", sources, re.M))
    assert set(re.findall(r"`(test_\w+)`", PAGES[page])) <= defined


def test_fields_of_the_scenario_are_named_rightly():
    fields = {*dess.Scenario.model_fields}
    page = PAGES["docs/concepts/model.md"] + PAGES["docs/concepts/beyond.md"]
    decisions = page.split("## Decisions")[1].split("\n## ")[0]
    cells = [row.split("|")[3] for row in decisions.splitlines() if row.startswith("| ")][2:]
    named = {name for cell in cells for name in re.findall(r"`(\w+)`", cell)}
    assert named <= fields
    text = re.sub(r"^```.*?^```", "", page, flags=re.M | re.S)
    code = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", text))))
    assert fields <= code


def test_the_columns_of_records_and_events_are_all_explained():
    columns = EventLog().columns()
    pages = ("concepts/model.md", "concepts/beyond.md", "reference/event-log.md")
    text = "".join(PAGES[f"docs/{page}"] for page in pages)
    for name in (*EVENT_NAMES, *columns, *MISSION_RECORD.names, *UAV_RECORD.names):
        assert f"`{name}`" in text, name


ARCHITECTURE = PAGES["docs/architecture.md"]


def test_the_places_of_the_architecture_page_exist():
    """A place is a path from the root of the repository, with the name in it after a colon."""
    last = ""
    places = re.findall(r"`([\w./-]*/[\w./-]*)?(?::(\w+))?`", ARCHITECTURE)
    assert sum(bool(path) for path, _ in places) > 100
    for path, name in places:
        last = path or last
        assert (ROOT / last).exists(), last
        if name:
            assert re.search(rf"\b{name}\b", (ROOT / last).read_text("utf-8")), f"{last}:{name}"


def test_the_architecture_page_stays_short():
    prose = re.sub(r"`[^`]*`|\|", " ", ARCHITECTURE)
    assert len(ARCHITECTURE.split()) <= 1500
    for row in re.findall(r"^\| .*$", prose, re.M):
        assert len(row.split()) <= 25, row


# --- snippets ---


@pytest.mark.parametrize("source", every("python"))
def test_snippets_compile(source):
    compile(source, "snippet", "exec")


@pytest.mark.parametrize("source", [p for p in every("python") if "print(" in p.values[0]])
def test_snippets_run(source, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(source, "snippet", "exec"), {})
    assert capsys.readouterr().out


def test_the_site_shows_the_processes_as_they_are_in_the_code():
    source = (ROOT / "dess" / "model" / "mission.py").read_text("utf-8")
    shown_parts = hooks.PART.findall(PAGES["docs/concepts/processes.md"])
    assert {part for part, _ in shown_parts} == {"code", "example"}
    for part, process in shown_parts:
        if part == "example":
            continue
        (shown_code,) = blocks(hooks.code(process), "python")
        assert shown_code.startswith(f"def {process}(self")
        assert indent(shown_code, " " * 4) in source


def test_the_policy_of_the_how_to_page_collects(outside):
    policy, scenario = policies.load(outside), dess.load_scenario("paper")
    assert outside in policies.names()
    missions = dess.simulate_batch(scenario, policy, 7, 50).missions
    assert missions["success"].mean() > 0.8
    random = dess.simulate_batch(scenario, policies.load("random"), 7, 50).missions
    assert missions["collection_ratio"].mean() > 2 * random["collection_ratio"].mean()
    single = dess.simulate(scenario, policy, 7, 3).metrics
    assert single == missions[3]


# --- figures ---

METRICS = ("success", "collection_ratio", "collection_ratio_and_communication")


def evaluated(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    """What ``dess evaluate --json`` prints."""
    assert cli.main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def shown(interval: dict[str, float]) -> Any:
    """Mean, low and high in percent, to the last digit that is printed."""
    return pytest.approx([100 * interval[key] for key in ("mean", "low", "high")], abs=0.06)


@pytest.mark.slow
def test_the_table_of_policies_is_what_its_command_prints(capsys):
    printed = table(POLICIES, "policy | success")
    ratios = dess.simulate_batch("paper", "ddqn", 0, range(1000)).missions["collection_ratio"]
    paper = values.intervals_of_means(values.TABLE_IV, 1000, ratios.var(ddof=1))
    assert printed.pop("paper") == [shown(paper[m]._asdict()) for m in METRICS]
    (arguments,) = (a for a in command_lines("dess") if {"random-unguarded", "planner"} <= {*a})
    rows = evaluated(arguments, capsys)
    assert list(printed) == [row["policy"] for row in rows]
    for row in rows:
        assert printed[row["policy"]] == [shown(row[m]) for m in METRICS]


def test_the_readme_has_the_figures_of_the_table_of_policies():
    rows = re.findall(r"^ +\| .*(?:`(\w+)`|the (paper)'s).*?\| (.*) \|$", README, re.M)
    assert [a or b for a, b, _ in rows] == ["greedy", "ddqn", "planner", "paper"]
    for name, other, cells in rows:
        assert re.search(rf"^\| `?{name or other}`? \| {re.escape(cells)} \|$", POLICIES, re.M)


@pytest.mark.slow
def test_the_readme_says_how_often_uavs_have_the_battery_for_the_way_home(capsys):
    arguments = ["evaluate", "--policy", "greedy", "--policy", "ddqn", "--missions", "1000"]
    rows = evaluated(arguments, capsys)
    for row, policy in zip(rows, ("greedy", "ddqn"), strict=True):
        text = numbers.format_interval(*row["home"].values())
        assert re.search(rf"{re.escape(text)}\s+(of the missions )?with `{policy}`", README)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_the_readme_quotes_the_answers_of_its_commands(tmp_path, monkeypatch, capsys, number):
    line = re.findall(r"^ *dess (sweep --.*)$", join_lines(README), re.M)[number]
    lines = re.findall(r"^> (\*\*Buy .*?\*\*|\| [a-z].* \|)$", README, re.M)
    paragraph = re.findall(r"^ +(\*Buy .*?) With `--price", README, re.M | re.S)[0]
    quoted = [
        [part.strip("*| ") for cells in lines for part in cells.split(" | ")],
        re.findall(r"\*(.*?)\*", " ".join(paragraph.split())),
    ][number]
    monkeypatch.chdir(tmp_path)
    assert cli.main([*shlex.split(line), "--json"]) == 0
    told = " ".join(json.loads(capsys.readouterr().out)["answers"])
    assert len(quoted) > 2 and all(part in told for part in quoted)


@pytest.mark.slow
def test_the_table_by_fleet_is_what_its_commands_print(capsys):
    printed = table(POLICIES, "policy | I = 1")
    by_fleet = [
        a for a in command_lines("dess") if a[0] == "evaluate" and "tour" in a and "uavs=" in a[2]
    ]
    assert len(by_fleet) == 3
    for column, arguments in enumerate(by_fleet):
        for row in evaluated(arguments, capsys):
            assert printed[row["policy"]][column] == shown(row[METRICS[2]])


def test_the_sampling_of_ends_errs_as_the_page_says():
    page = PAGES["docs/concepts/left-out.md"]
    for name, numbers_of in table(page, "communication slots m").items():
        slots = int(name.split(",")[0]) if name[0].isdigit() else 64
        space = load_scenario("paper", communication_slots=slots)
        rates = np.log2(1 + 10 ** (world_of(space).mean_snr[0, : slots + 1] / 10)) / slots
        onto, leaving = rates[:-1].sum(), rates[1:].sum()
        if name == "the integral":
            onto = leaving = (onto + leaving) / 2  # the trapezoidal rule
        found = [[onto], [leaving], [onto - leaving]]
        assert np.round(found, 2).tolist() == numbers_of


def test_the_table_of_scale_is_that_of_the_measured_numbers():
    measured = pd.read_csv(ROOT / "benchmarks" / "scale.csv")
    page = PAGES["docs/performance.md"]
    assert scale.table(measured) in page
    speed_ups = measured[measured["axis"] == "workers"].set_index("value")["speed_up"]
    assert f"100 workers are {speed_ups[100]:.0f} times as fast as one" in page


def test_the_table_of_what_learning_needs_is_that_of_the_shipped_curves():
    curves = pd.read_parquet(ROOT / "policies/trained/curves.parquet")
    page = ROOT / "benchmarks" / "trainings.md"
    assert learning_curves.table(curves) in page.read_text("utf-8")
    for variant in ("quick", "no transfer"):  # Fig. 3: three training seeds, the same budget
        runs = curves[curves["variant"] == variant].groupby("seed")["tick"].max()
        assert len(runs) >= 3
        assert runs.nunique() == 1
