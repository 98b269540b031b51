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
# From the coordinates of sensor nodes to a decision: which fleet is the cheapest that serves this
# sea, and why no cheaper one does.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "bay"  # the sea: a TOML file, or this shipped example
example = {"uavs": 3, "pads": 2}  # the fleet of the mission to look at
fields = {"uavs": [2, 3], "pads": [1, 2, 3], "arrival_rate": [0.01, 0.03]}
policies = ["greedy"]
prices = {"uav": 20_000, "pad": 3_000, "charge": 2, "hour": 100, "slot_seconds": 60}
currency, flights = "EUR", 500  # of the prices; missions that the fleet is to fly
requirements = {"success": 0.99, "collection_ratio": 0.68}  # the least means
missions = 300  # further ones, that check the selected settings
seed = 0  # of the missions
workers = 1  # processes

# %%
from analysis import numbers, sweep
from analysis.figures.missions import mission_figure, sea_figure
from analysis.names import METRICS
from analysis.results.resimulate import mission_of
from dess import load_scenario
from reports.pages import html

# %% [markdown]
# ## The sea
#
# A sea is a TOML file, and the coordinates of its sensor nodes are in a file beside it:
#
# ```toml
# nodes = "bay.csv"
# grid = 40               # cells along one side
# cell_size = 800         # metres
# zone = [36, 18, 3, 3]   # where UAVs start and charge: x, y, width and height in cells
# quota = 600             # communication slots that every UAV must fill
# ```
#
# The CSV file has columns `lon` and `lat` in degrees, or `x` and `y` in cells; a GeoJSON file of
# points does as well. Degrees are projected, centred on the grid and rounded to cells. All fields
# that the file does not set are those of the paper.

# %%
sea = load_scenario(scenario)
html.say(
    "This one has {nodes} sensor nodes on {grid} x {grid} cells of {size:g} m, and a zone of "
    "{pads} cells, each with room for a charging pad.",
    nodes=len(sea.nodes),
    grid=sea.grid,
    size=sea.cell_size,
    pads=sea.zone_cells,
)

# %%
caption = f"n = {len(sea.nodes)} sensor nodes, and the zone; y grows south."
html.figure(sea_figure(sea), "Map of the sea", caption)

# %% [markdown]
# ## A mission to look at
#
# One example (n = 1), to see whether the sea is as it was meant.

# %%
mission = mission_of(load_scenario(scenario, **example), policies[0], seed)
caption = f"A mission of {policies[0]}, replication 0 (n = 1)."
drawing = mission_figure(mission.events, mission.scenario)
html.figure(drawing, "Map of the mission; battery, residual data and charging", caption)

# %% [markdown]
# ## The sweep
#
# Every fleet meets every condition. With prices and requirements, as many missions are simulated as
# it takes to find the cheapest fleet that meets the requirements, with a stated confidence.

# %%
priced = {**prices, "currency": currency, "missions": flights}
about = (scenario, policies, missions, seed, results, workers, priced, requirements)
answer = sweep(*about, **fields)

# %%
html.say(
    "{settings} settings, {n:,} missions. The guarantee: {guarantee}.",
    settings=len(answer.table()),
    n=len(answer.results.missions),
    guarantee=answer.guarantee,
)

# %% [markdown]
# ## The decision

# %%
html.say("{answers}", answers="\n".join(f"- {line}" for line in answer.answers()))

# %% [markdown]
# The settings with their costs, the cheapest first. A setting *meets* the requirements, *misses*
# them, or it is *open*, where no more missions were needed to decide.

# %%
columns = ["policy", *answer.fields, "success", "collection_ratio", "n", "cost", "verdict"]
costs = answer.table("cost")
shown = costs[columns].assign(cost=costs["cost"].map("{:,.0f}".format))
shown[[*METRICS][:2]] = shown[[*METRICS][:2]].map(numbers.percent)
html.table(shown, f"Mean cost over {flights:,} missions in {currency}", data=costs)

# %%
caption = "Success with 95 % intervals, of n missions as in the table: few, where ruled out early."
html.figure(answer.plot(metric="success"), "Success by field", caption)

# %% [markdown]
# ## On the command line
#
# This asks the same, and makes a page with more on it:

# %%
html.say("{lines}", lines=html.commands([answer.command]))

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([answer.results])
