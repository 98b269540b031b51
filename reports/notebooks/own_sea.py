# ---
# jupyter:
#   dess:
#     studies: []
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Which fleet is the cheapest for a sea of our own?
#
# From the coordinates of sensor nodes to the cheapest fleet that meets the requirements.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "bay"  # the sea: a TOML file, or this shipped example
fields = {"uavs": [1, 2, 3], "pads": [1, 2], "arrival_rate": [0.01, 0.03], "landing": True}
policies = ["generalist", "greedy"]  # None: the best that five minutes allow, and greedy
prices = {"uav": 20_000, "pad": 10_000, "charge": 2, "hour": 100, "slot_seconds": 60}
currency, planned = "EUR", 200  # currency of the prices; number of missions planned for the fleet
requirements = {"success": 0.99, "collection_ratio": 0.6}  # the lowest acceptable means
missions = 300  # additional missions that check each selected setting
seed = 0  # seed of the missions
workers = 1  # processes
yes = False  # True if the sweep may take more than an hour

# %%
from dess import load_scenario
from dess.analysis import sweep
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import cost_parts_table
from dess.analysis.answers.fleet.figures import draw_cheapest
from dess.analysis.answers.missions import map_caption
from dess.analysis.answers.settings.points import fleets_in_words, has_conditions
from dess.analysis.answers.worst_missions import worst_missions, worst_missions_table
from dess.analysis.ask import around
from dess.analysis.ask.falls import draw_falls
from dess.analysis.ask.limit_search import find_limits
from dess.analysis.figures.missions import mission_figure, sea_figure
from dess.analysis.names import node_placing_sentence
from dess.analysis.results.resimulate import resimulate
from dess.reports.pages import study
from dess.reports.pages.markdown import command_block, write_markdown
from dess.reports.pages.parts import (
    lead_figure,
    make_answer,
    make_assumptions,
    make_facts,
    make_gallery,
    show_parts,
)
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.templates import render_part

# %%
sea = load_scenario(scenario)
priced = {**prices, "currency": currency}
if "years" not in prices:
    priced["missions"] = planned
costs = {"prices": priced, "requirements": requirements}
answer = sweep(scenario, policies, missions, seed, results, workers, yes=yes, **costs, **fields)

# %%
found = answer.results
if asked := around.question_around(found, scenario):
    asked.ask(workers, yes=yes)
    find_limits(found, scenario, workers)
search = search_of(found)
make_answer(answer.headline(), search.best.fleet)

# %%
lead_figure(*draw_cheapest(found))

# %%
make_facts(answer.facts())

# %%
if sea.units:
    show_parts(study.draw_typical_mission(found))

# %%
point = search.shown_point
shown = found.scenario(point)
study.make_panel_of(found)

# %%
make_assumptions(answer.assumptions()) if sea.units else None

# %% [markdown]
# ## Why

# %%
show_parts(fleet_tables.fleet_table(found))

# %%
mission = resimulate(found, search.best.policy, point, 0)
map_of_mission = mission_figure(mission.events, mission.scenario)
about_mission = map_caption(mission, fleets_in_words(found)[point])

# %%
about_sea = f"The n = {len(sea.nodes)} nodes and the zone.{node_placing_sentence(sea)}"
make_gallery(
    [
        (sea_figure(sea), "Map of the sea", about_sea),
        (map_of_mission, "Map of a mission of the answer", about_mission),
    ]
)

# %%
if around.is_known(found):
    show_parts(around.table_around(found), draw_falls(found))

# %% [markdown]
# ## How far to trust it
#
# The check had no part in the search, so its means are unbiased.

# %%
no_check = write_markdown("No fleet was checked.")
show_parts(
    no_check if found.checks.empty else fleet_tables.check_table(found),
    write_markdown("{guarantees}", guarantees=study.list_guarantees(found)),
)

# %% [markdown]
# ## Tables

# %%
if has_conditions(found):
    show_parts(fleet_tables.condition_table(found))
show_parts(cost_parts_table(found))

# %%
show_parts(worst_missions_table(found, worst_missions(found, search.best.policy, point=point)))

# %% [markdown]
# ## With your own sea
#
# A sea is a TOML file; a CSV or GeoJSON file in the same folder has the coordinates of its nodes,
# in degrees (`lon`, `lat`) or cells (`x`, `y`). What the file does not set is as in the paper.
#
# ```toml
# nodes = "nodes.csv"
# grid = 40               # cells along one side
# cell_size = 800         # metres
# zone = [36, 18, 3, 3]   # where UAVs start and charge: x, y, width and height in cells
# quota = 600             # communication slots that every UAV must fill
# ```
#
# This command runs the same sweep and makes a page with more details:

# %%
write_markdown("{lines}", lines=command_block([answer.command]))

# %%
render_part("left_out.html") if sea.units else None

# %% [markdown]
# ## How this page was made

# %%
write_markdown(
    "The sea has {nodes} sensor nodes on {columns} x {rows} cells of {size:g} m. The sweep has "
    "{settings} settings and simulated {n:,} missions. Costs are means for {planned:,} missions.",
    nodes=len(sea.nodes),
    columns=sea.size[0],
    rows=sea.size[1],
    size=sea.cell_size,
    settings=len(answer.table()),
    n=len(found.missions),
    planned=found.prices.paid_missions,
)

# %%
provenance_table([found])
