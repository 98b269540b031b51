"""Pages of other packages: rendered, and in the index, like those of dess."""

import sys

import pytest

from dess import InputError
from dess.analysis import run_study
from dess.reports.pages.notebook import NAMES, find_groups, read_report, report_names
from dess.reports.pages.outside import GROUP
from dess.reports.pages.render import render
from tests.analysis.small import small_study
from tests.outside import install_package
from tests.reports.here import notebooks_here
from tests.reports.small import words_of

# A notebook as a package would have it: in the group of the policies, with a section and a table.
SLOTS = """# ---
# jupyter:
#   dess:
#     studies: [trial]
#     group: The policies
# ---

# %% [markdown]
# # How long do missions take?
#
# The slots of every mission.

# %% tags=["parameters"]
results = "results"  # folder with the results folder of trial
first = 2  # missions that are shown

# %%
from pathlib import Path

from dess.analysis import load_results
from dess.reports.pages.parts import make_answer
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

trial = load_results(Path(results) / "trial")
slots = trial.missions["slots"]
make_answer(f"A mission takes {slots.mean():.1f} slots.", f"{slots.mean():.1f}")

# %% [markdown]
# ## The first of them

# %%
make_table(trial.missions[["replication", "slots"]].head(first))

# %%
provenance_table([trial])
"""
LONE = SLOTS.replace("#     group: The policies\n", "")
BROKEN = {
    "its notebook does not begin with a heading": LONE.replace("# # How", "# How"),
    "the metadata of its notebook have no list": LONE.replace("[trial]", "trial"),
    "its notebook has no cell tagged parameters": LONE.replace(' tags=["parameters"]', ""),
}


@pytest.fixture
def install(tmp_path, monkeypatch):
    def install(source: str, **pages: str) -> None:
        install_package(tmp_path / "site", monkeypatch, "slots_of_missions", source, GROUP, **pages)

    return install


def test_a_page_of_a_package_is_rendered_and_stands_in_its_group(install, tmp_path):
    """It takes parameters, and its module is read and not imported."""
    install(SLOTS, **{"slots-of-missions": "slots_of_missions"})
    study = run_study(small_study(tmp_path), tmp_path / "results" / "trial")
    out = tmp_path / "out"
    with notebooks_here():
        asked = ["slots-of-missions"]
        render(asked, tmp_path / "results", out, parameters={"first": 3})
    page = (out / "slots-of-missions.html").read_text("utf-8")
    assert f"takes {study.missions['slots'].mean():.1f} slots" in page
    assert page.count("<tr") >= 4  # a heading and three missions
    index = words_of((out / "index.html").read_text("utf-8"))
    assert index.index("The policies") < index.index("How long do missions take?")
    assert report_names() == [*NAMES, "slots-of-missions"]
    assert find_groups()["The policies"][-1] == "slots-of-missions"
    assert "slots_of_missions" not in sys.modules


def test_a_page_without_a_group_comes_last(install):
    install(LONE, slots="slots_of_missions")
    assert [*find_groups().items()][-1] == ("Other pages", ["slots"])


@pytest.mark.parametrize(
    ("name", "module", "reason"),
    [
        ("comparison", "slots_of_missions", "no name of a further page"),
        ("study", "slots_of_missions", "no name of a further page"),
        ("study-trial", "slots_of_missions", "no name of a further page"),
        ("index", "slots_of_missions", "no name of a further page"),
        ("../slots", "slots_of_missions", "no name of a further page"),
        ("slots", "slots_of_nothing", "there is no module slots_of_nothing"),
        ("slots", "slots_of_nothing.page", "ModuleNotFoundError"),
    ],
)
def test_a_page_that_cannot_be_read_is_left_out_with_a_warning(
    install, caplog, name, module, reason
):
    install(SLOTS, **{name: module})
    assert report_names() == [*NAMES] and reason in caplog.text


@pytest.mark.parametrize("problem", BROKEN)
def test_a_module_that_is_no_report_is_refused_in_one_line(install, problem):
    install(BROKEN[problem], slots="slots_of_missions")
    with pytest.raises(InputError, match=f"^report slots: {problem}"):
        read_report("slots")
