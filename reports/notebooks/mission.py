# ---
# jupyter:
#   dess:
#     studies: [fig1, fig4]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Missions
#
# Where UAVs fly, which sensor node they serve on the way, when they charge and what they leave
# behind: missions like those of the paper's Fig. 1 and Fig. 4, drawn, and played slot by slot.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders of the studies fig1 and fig4
policy = None  # the policy to show; None for the best by collection ratio and communication
replication = 0  # the replication to show, one whose event log is kept

# %%
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from analysis import load_results, numbers, summary
from analysis.figures import missions as figures
from analysis.replication import paper
from dess.scenario import SAMPLED
from reports.pages import html
from reports.player import READING, library, player

example, study = (load_results(Path(results) / name) for name in ("fig1", "fig4"))
means = summary(study.missions, by=["policy"])
product = means[means["metric"] == "collection_ratio_and_communication"].set_index("policy")
policy = policy or product["mean"].idxmax()
ratios = summary(study.missions.query("policy == @policy"), by=["point"])
ratios = ratios[ratios["metric"] == "collection_ratio"].set_index("point")

points = range(len(study.manifest["points"]))
seed = study.manifest["seed"]
shown = "policy == @policy and replication == @replication"
missions = study.missions.query(shown).set_index("point")
uavs = study.uavs.query(shown)
logs = [study.events(policy, point, replication) for point in points]
scenarios = [
    study.scenario(point).scenario_at(**{key: int(missions.loc[point, key]) for key in SAMPLED})
    for point in points
]

# %% [markdown]
# ## One UAV on a small map: the paper's Fig. 1

# %%
ranked = summary(example.missions, by=["policy"])
ranked = ranked[ranked["metric"] == "collection_ratio_and_communication"].set_index("policy")
pilot = ranked["mean"].idxmax()
flown = example.missions.query("policy == @pilot and replication == @replication").iloc[0]
log = example.events(pilot, 0, replication)
small = example.scenario().scenario_at(**{key: int(flown[key]) for key in SAMPLED})
display(
    Markdown(
        f"A map of {small.grid} x {small.grid} cells with {len(small.nodes)} nodes. The paper "
        "draws this example without numbers, so there is nothing to compare with; the mission "
        f"here is flown by **{pilot}**, of {numbers.words(example.policies)} the best by collection "
        f"ratio and communication: {numbers.interval(*ranked.loc[pilot, ['mean', 'low', 'high']])}, "
        f"n = {ranked.loc[pilot, 'n']:,} missions. What is learned is learned on one map, so no "
        "learned policy can fly it."
    )
)
html.gallery(
    [
        (
            figures.mission_figure(log, small),
            "Map of the mission; battery, residual data and charging",
            f"n = 1 mission, replication {replication} of seed {example.manifest['seed']}: "
            f"{flown['slots']} mission slots, {flown['collected']:.0f} of "
            f"{flown['initial'] + flown['arrived']:.0f} data units collected.",
        )
    ]
)

# %% [markdown]
# **How to read the map.** Every sensor node has a colour. An arrow is the move of one mission slot,
# in the colour of the node that was served in most of the slot's communication slots (the last of
# them on a tie); grey where none was. A cross is a slot of hovering, in the same colours, a star a
# slot of charging. A numbered diamond is where a UAV starts, a dot where its mission ends. UAVs
# that share a path are drawn side by side. y grows south.
#
# **How to read the curves.** C<sub>S</sub> is the battery at or below which a UAV may start to
# charge, C<sub>C</sub> the one at which charging ends. A band of residual data is one node, in its
# colour; bands that stay are nodes that nobody has emptied.

# %% [markdown]
# ## <a id="fig-4"></a>From one to three UAVs: the paper's Fig. 4

# %%
best = " the best of the study by" if policy == product["mean"].idxmax() else ""
display(
    Markdown(
        f"The policy is **{policy}**,{best} collection ratio and communication "
        f"{numbers.interval(*product.loc[policy, ['mean', 'low', 'high']])} over "
        f"{product.loc[policy, 'n']:,} missions. Each column is a single mission, replication "
        f"{replication} of seed {seed}: an example, not an average. All three meet the same sea: "
        "initial data, arrivals and shadowing are equal, only the number of UAVs differs."
    )
)


# %%
printed = [paper.FIG_4[uavs]["collection_ratio"] for uavs in missions["uavs"]]


def captioned(point):
    mission, ratio = missions.loc[point], ratios.loc[point]
    caption = (
        f"n = 1 mission of {mission['slots']} slots; {mission['collected']:.0f} of "
        f"{mission['initial'] + mission['arrived']:.0f} data units collected. The mean of this "
        f"policy, n = {ratio['n']:,}, is {numbers.interval(*ratio[['mean', 'low', 'high']])}, "
        f"the paper's {numbers.percent(printed[point])}."
    )
    figure = figures.mission_figure(logs[point], scenarios[point])
    alt = f"Map of the mission with I = {mission['uavs']}; battery, residual data and charging"
    return figure, alt, caption


html.gallery([captioned(point) for point in points])

# %% [markdown]
# ## Slot by slot

# %%
display(
    Markdown(f"The same missions, to play, to pause and to leaf through on a screen. {READING}")
)
display(library())
for point in points:
    mission = missions.loc[point]
    caption = (
        f"n = 1 mission of {policy}, replication {replication} of seed {seed}, "
        f"{mission['slots']} mission slots, {len(logs[point]):,} events. A single mission has no "
        "interval."
    )
    title = f"I = {mission['uavs']}: {numbers.percent(mission['collection_ratio'])} collected"
    display(player(logs[point], scenarios[point], f"player-{mission['uavs']}", title, caption))

# %% [markdown]
# ## What one sees


# %%
def sights(point):
    log, mission = logs[point], missions.loc[point]
    served = set(log.loc[log["event"] == "communication", "node"])
    ends = log[(log["event"] == "mission_end") & (log["node"] >= 0)]
    fullest = ends.loc[ends["value"].idxmax()]
    return {
        "UAVs": mission["uavs"],
        "Success": "yes" if mission["success"] else "no",
        "Collected": numbers.percent(mission["collection_ratio"]),
        "Mission slots": mission["slots"],
        "Charging sessions": (log["event"] == "charge_start").sum(),
        "Nodes never served": f"{len(ends) - len(served)} of {len(ends)}",
        "Data left": f"{mission['residual']:.1f}",
        "Fullest node left": f"{fullest['value']:.1f} at ({fullest['x']:.0f}, {fullest['y']:.0f})",
    }


seen = pd.DataFrame([sights(point) for point in points])
first, last = seen.iloc[0], seen.iloc[-1]
display(
    Markdown(
        f"From {first['UAVs']} to {last['UAVs']} UAVs, what is collected goes from "
        f"{first['Collected']} to {last['Collected']} in these missions, from "
        f"{numbers.percent(ratios['mean'].iloc[0])} to {numbers.percent(ratios['mean'].iloc[-1])} in the "
        f"mean of {policy}, and from {numbers.percent(printed[0])} to {numbers.percent(printed[-1])} in "
        "the paper."
    )
)
html.table(seen, "The three missions; data in data units")

# %% [markdown]
# ## Every UAV

# %%
html.table(
    pd.DataFrame(
        {
            "UAVs": uavs["point"].map(missions["uavs"]),
            "UAV": uavs["uav"] + 1,
            "Communications": [f"{n} of {scenarios[0].quota}" for n in uavs["quota"]],
            "Data collected": uavs["collected"].map("{:.1f}".format),
            "Slots flying": uavs["slots_flying"],
            "Slots charging": uavs["slots_charging"],
            "Slots waiting": uavs["slots_waiting"],
            "Battery at the end": uavs["battery"].map("{} %".format),
            "End": uavs["end"].map(
                {"quota": "quota filled", "battery": "battery empty", "truncated": "out of time"}
            ),
        }
    ),
    "Communications are the communication slots that count toward the quota",
)

# %% [markdown]
# ## Where the figures come from

# %%
command = (
    f"dess simulate --scenario {study.manifest['study']['scenario']} --set uavs={{}} "
    f"--policy {policy} --seed {seed} --replication {replication}"
)
display(
    Markdown(
        "Each mission can be flown again:\n\n"
        + html.commands(command.format(uavs) for uavs in missions["uavs"])
    )
)
html.provenance([example, study])
