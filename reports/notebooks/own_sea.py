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
# # An own sea
#
# This page leads from the coordinates of sensor nodes to a decision: which is the cheapest fleet
# that meets the requirements at this sea, and why a cheaper fleet does not meet them.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "bay"  # the sea: a TOML file, or this shipped example
example = {"uavs": 3, "pads": 2}  # the fleet of the example mission
fields = {"uavs": [2, 3], "pads": [1, 2, 3], "arrival_rate": [0.01, 0.03]}
policies = ["greedy"]
prices = {"uav": 20_000, "pad": 3_000, "charge": 2, "hour": 100, "slot_seconds": 60}
currency, planned = "EUR", 500  # currency of the prices; number of missions planned for the fleet
requirements = {"success": 0.99, "collection_ratio": 0.68}  # the lowest acceptable means
missions = 300  # additional missions that check each selected setting
seed = 0  # seed of the missions
workers = 1  # processes
yes = False  # True if the sweep may take more than an hour

# %%
from analysis import numbers, sweep
from analysis.figures.missions import mission_figure, sea_figure
from analysis.names import METRICS
from analysis.results.resimulate import mission_of
from dess import load_scenario
from policies import load_team
from reports.pages import html

# %% [markdown]
# ## The sea
#
# A sea is a TOML file; a second file in the same folder has the coordinates of its sensor nodes:
#
# ```toml
# nodes = "bay.csv"
# grid = 40               # cells along one side
# cell_size = 800         # metres
# zone = [36, 18, 3, 3]   # where UAVs start and charge: x, y, width and height in cells
# quota = 600             # communication slots that every UAV must fill
# ```
#
# The CSV file has the columns `lon` and `lat` in degrees, or `x` and `y` in cells; a GeoJSON file
# of points is also possible. Degrees are projected, centred on the grid and rounded to cells. All
# fields that the TOML file does not set have the values of the paper.

# %%
sea = load_scenario(scenario)
html.say(
    "This sea has {nodes} sensor nodes on {grid} x {grid} cells with a side of {size:g} m. Its "
    "zone has {pads} cells, each with room for one charging pad.",
    nodes=len(sea.nodes),
    grid=sea.grid,
    size=sea.cell_size,
    pads=sea.zone_cells,
)

# %%
caption = f"The n = {len(sea.nodes)} sensor nodes and the zone. The y axis points south."
html.figure(sea_figure(sea), "Map of the sea", caption)

# %% [markdown]
# ## An example mission
#
# A single mission (n = 1) helps to check that the sea is described as intended.

# %%
mission = mission_of(load_scenario(scenario, **example), load_team(policies[0]), seed)
caption = f"A mission of {policies[0]}, replication 0 (n = 1)."
drawing = mission_figure(mission.events, mission.scenario)
html.figure(drawing, "Map of the mission; battery, residual data and charging", caption)

# %% [markdown]
# ## The sweep
#
# Every fleet is simulated under every condition. With prices and requirements, a procedure adds
# missions until it has found the cheapest fleet that meets the requirements, with a stated
# confidence.

# %%
priced = {**prices, "currency": currency, "missions": planned}
about = (scenario, policies, missions, seed, results, workers, priced, requirements)
answer = sweep(*about, yes=yes, **fields)

# %%
html.say(
    "The sweep has {settings} settings and simulated {n:,} missions. Its guarantee: {guarantee}.",
    settings=len(answer.table()),
    n=len(answer.results.missions),
    guarantee=answer.guarantee,
)

# %% [markdown]
# ## The decision

# %%
html.say("{lines}", lines=html.composed("\n".join(f"- {line}" for line in answer.answers())))

# %% [markdown]
# The table lists the settings by cost, the cheapest first. The verdict on the
# requirements is *met*, *missed*, or *open* where no decision was needed to find the cheapest
# fleet.

# %%
columns = ["policy", *answer.fields, "success", "collection_ratio", "n", "cost", "verdict"]
costs = answer.table("cost")
shown = costs[columns].assign(cost=costs["cost"].map("{:,.0f}".format))
shown[[*METRICS][:2]] = shown[[*METRICS][:2]].map(numbers.percent)
html.table(shown, f"Mean cost of {planned:,} planned missions in {currency}", data=costs)

# %%
caption = "Success with 95 % intervals. n is small for settings that were ruled out early."
html.figure(answer.plot(metric="success"), "Success by field", caption)

# %% [markdown]
# ## On the command line
#
# The following command runs the same sweep and makes a page with more details:

# %%
html.say("{lines}", lines=html.commands([answer.command]))

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([answer.results])
