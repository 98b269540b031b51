# ---
# jupyter:
#   dess:
#     studies: [fig1, fig4]
#     scripts: true
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Missions
#
# This page shows where the UAVs fly, which sensor nodes they serve on the way, when they charge,
# and how much data is left. Missions like those of the paper's Fig. 1 and Fig. 4 are drawn, and can
# be played slot by slot.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders of the studies fig1 and fig4
policy = None  # the policy to show; None for the best by product
replication = 0  # the replication to show; the study must have stored its event log

# %%
from pathlib import Path

from IPython.display import display
from matplotlib.figure import Figure

from analysis import load_results, numbers
from analysis.figures.missions import mission_figure
from analysis.names import RATIO
from analysis.questions import missions
from analysis.questions.summary import best_policy
from analysis.replication import paper
from reports.pages import html
from reports.player import READING, library, player

# %%
fig1, fig4 = (load_results(Path(results) / name) for name in ("fig1", "fig4"))
shown_policy = policy or best_policy(fig4.missions)
seed = fig4.manifest["seed"]
points = range(len(fig4.manifest["points"]))
shown = [missions.logged_mission(fig4, shown_policy, point, replication) for point in points]
printed = [paper.FIG_4[mission.scenario.uavs][RATIO] for mission in shown]

# %% [markdown]
# ## One UAV on a small map: the paper's Fig. 1

# %%
best = best_policy(fig1.missions)
example = missions.logged_mission(fig1, best, 0, replication)
mean = missions.estimate(fig1, best)
html.say(
    "The map has {grid} x {grid} cells and {nodes} nodes. The policy of this mission is "
    "**{best}**, the best of {policies} by product: {mean}, n = {n:,}.",
    grid=example.scenario.grid, nodes=len(example.scenario.nodes), best=best,
    policies=numbers.words(fig1.policies), mean=numbers.estimate(mean), n=mean["n"],
)  # fmt: skip

# %% [markdown]
# The paper draws this example without numbers, so nothing can be compared. A learned policy works
# only on the map of its training, so none can be used here.

# %%
caption = (
    f"n = 1 mission, replication {replication} of seed {fig1.manifest['seed']}: "
    f"{example.row['slots']} mission slots, {example.collected}."
)
alt = "Map of the mission; battery, residual data and charging"
html.gallery([(mission_figure(example.log, example.scenario), alt, caption)])

# %% [markdown]
# **How to read the map.** Every sensor node has a colour. An arrow is the move of a UAV in one
# mission slot; it has the colour of the node that was served in most communication slots of that
# slot (on a tie, the last of them), and is grey if no node was served. A cross is a slot in which
# the UAV hovered, in the same colours, a star a slot in which it charged. A UAV starts at a
# numbered diamond, and its mission ends at a dot. UAVs on the same path are drawn side by side. The
# y axis points south.
#
# **How to read the curves.** A UAV may start to charge when its battery is at or below
# C<sub>S</sub>; charging ends at C<sub>C</sub>. Each band of residual data is one node, in its
# colour. A band that remains at the end is a node that still has data.

# %% [markdown]
# ## <a id="fig-4"></a>From one to three UAVs: the paper's Fig. 4

# %%
mean = missions.estimate(fig4, shown_policy)
html.say(
    "The policy is **{policy}**: the mean of its product over the three "
    "numbers of UAVs is {mean}, each number with the same weight ({n:,} missions in all). The best "
    "policy of the study is {best}. Each column is replication {replication} of seed {seed}.",
    policy=shown_policy, mean=numbers.estimate(mean), n=mean["n"],
    best=best_policy(fig4.missions), replication=replication, seed=seed,
)  # fmt: skip

# %% [markdown]
# Each is a single mission: an example, not an average. All three have the same random initial data,
# arrivals and shadowing; only the number of UAVs differs.


# %%
def captioned(point: int) -> tuple[Figure, str, str]:
    mission, mean = shown[point], missions.estimate(fig4, shown_policy, RATIO, point)
    caption = (
        f"n = 1 mission of {mission.row['slots']} slots; {mission.collected}. The mean of this "
        f"policy, n = {mean['n']:,}, is {numbers.estimate(mean)}, the paper's "
        f"{numbers.percent(printed[point])}."
    )
    alt = (
        f"Map of the mission with I = {mission.scenario.uavs}; battery, residual data and charging"
    )
    return mission_figure(mission.log, mission.scenario), alt, caption


html.gallery([captioned(point) for point in points])

# %% [markdown]
# A UAV seldom runs out of energy on its way, because all policies here act under the return guard:
# it allows only actions after which a UAV can still reach the charging zone in time.

# %% [markdown]
# ## Slot by slot
#
# The players show the same missions: press *Play*, or move the slider.

# %%
display(html.say("{reading}", reading=READING))
library()

# %%
for mission in shown:
    title = f"I = {mission.scenario.uavs}: {numbers.percent(mission.row[RATIO])} collected"
    caption = (
        f"n = 1 mission of {shown_policy}, replication {replication} of seed {seed}, "
        f"{mission.row['slots']} mission slots, {len(mission.log):,} events. A single mission has "
        "no interval."
    )
    name = f"player-{mission.scenario.uavs}"
    display(player(mission.log, mission.scenario, name, title, caption))

# %% [markdown]
# ## The missions in numbers

# %%
html.table(missions.outcome_table(shown), "The three missions; data in data units")

# %% [markdown]
# ## Every UAV

# %%
html.table(
    missions.uav_table(shown),
    "Communications are the communication slots that count towards the quota",
)

# %% [markdown]
# ## Where the figures come from
#
# These commands simulate the missions again:

# %%
command = (
    f"dess simulate --scenario {fig4.manifest['study']['scenario']} --set uavs={{}} "
    f"--policy {shown_policy} --seed {seed} --replication {replication}"
)
html.say("{commands}", commands=html.commands(command.format(m.scenario.uavs) for m in shown))

# %%
html.provenance([fig1, fig4])
