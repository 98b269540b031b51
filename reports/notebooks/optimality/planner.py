# ---
# jupyter:
#   dess:
#     studies: [gap]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Does planning beat learning?
#
# A policy that plans and one that has learned, in the same missions, and the time that they take.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folder gap
planner = "planner"  # the policy that plans
longer = "planner-long"  # the same with a longer search, if the study has it
learner = "ddqn"  # the policy that has learned

# %%
from pathlib import Path

from analysis import load_results, numbers
from analysis.answers import comparison as answers
from analysis.answers import optimality
from analysis.figures import comparison, learning, settings
from analysis.figures import missions as maps
from analysis.names import PRODUCT
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "gap")
times = answers.read(results, study)
planners = [planner, *(name for name in [longer] if name in study.policies)]
differences = optimality.differences(study, planners, learner)
pair = answers.pair_of(study, planner, learner)
missions = answers.duels(study, pair)
logged = study.manifest["study"]["logged"]

# %%
html.answer(optimality.answer(differences, planner), optimality.ahead(differences, planner))

# %%
by_product = differences[differences["metric"] == PRODUCT]
html.lead(
    comparison.differences(by_product),
    f"Paired differences from {learner} in the product, by number of UAVs",
    f"n = {numbers.span(by_product['n'])} missions; bars are 95 % intervals.",
)

# %% [markdown]
# ## Why: where each of them wins
#
# Blue means that the planner is better, orange the learner, hollow inconclusive (Holm, over all
# bins); dashed is the mean of all missions.

# %%
lead = answers.along(missions, pair.candidates)
html.gallery(
    [
        (
            comparison.lead(lead, field, missions["difference"].mean()),
            f"Mean difference {planner} − {learner} against {field}",
            f"{planner} − {learner}, n = {numbers.span(bins['n'])} missions per dot.",
        )
        for field, bins in lead.groupby("field", sort=False)
    ]
)

# %%
first, second = (optimality.coverage(study, policy) for policy in (planner, learner))
collected = {f"Collected by {planner}": first, f"Collected by {learner}": second}
shown = collected | {f"{planner} − {learner}": first - second}
counted = f"means over n = {logged} missions, in percent of the node's data."
nodes = study.scenario()
html.gallery(
    [
        (maps.node_map(nodes, title, values, title not in collected), title, f"{title}: {counted}")
        for title, values in shown.items()
    ]
)

# %%
home = optimality.at_home(study, [planner, learner])
rows = home.assign(panel=0, **dict.fromkeys(("mean", "low", "high"), home["share"]))
zone = learning.courses(rows, "policy", "%", {0: "Share of the UAVs in the charging zone"})
mission = optimality.example(study, planner)
replication = mission.replication
plan = maps.plan(mission.events, mission.scenario, optimality.plan(study, planner, replication))
values, title = optimality.node_prices(study, replication), "Price of a node's data"
prices = maps.node_map(nodes, title, values, write="{:.2f}".format)

# %%
counted = f"n = {logged} missions. A UAV that has filled its quota has left the mission."
paid = f"n = 1, mission {replication}: what one more data unit would add to the upper bound."
html.gallery(
    [
        (zone, "The share of the UAVs in the charging zone over the slots", counted, home),
        (plan, "The plan of the first slot, over the mission as simulated", mission.caption),
        (prices, "The price of every node's data in the upper bound", paid),
    ]
)

# %% [markdown]
# ## How far to trust it
#
# All policies meet the same missions. The best possible policy is between the best one here and the
# upper bound.

# %%
html.say("{gap}", gap=html.composed(optimality.in_words(study, planners[-1])))

# %%
points, gaps = optimality.front(study, times), optimality.by_fleet(study)
useful = optimality.useful(gaps)
alt = "Decision time against the product of all policies, and their Pareto front"
caption = "No policy is both faster and better than one on the line. Medians on one core."
drawn: list[html.Drawing] = [(settings.decision_times(points), alt, caption, points)]
if len(useful):
    alt = "The product of every policy and the upper bound, by number of UAVs"
    drawn.append((comparison.gaps(useful), alt, "The band is the 95 % interval of the bound."))
html.gallery(drawn, f"n = {len(missions):,} missions per policy; bars are 95 % intervals.")

# %% [markdown]
# ## Tables

# %%
html.table(
    tables.estimates(
        differences.assign(mean=differences["difference"]),
        ["policy", "uavs", "n"],
        write=numbers.points,
    ),
    f"Paired differences from {learner} in points, with 95 % intervals",
    data=differences,
)

# %%
html.table(optimality.listed(gaps), "Means, the upper bound, and the gap in points", data=gaps)

# %%
html.table(
    optimality.returns(study, [planner, learner]),
    f"Means over charging sessions of the same {logged} missions",
)

# %%
html.table(answers.time_table(times), "Time of a decision for the UAVs of a mission")

# %% [markdown]
# ## How this page was made

# %%
html.say("{remarks}", remarks=answers.remarks(times, study, pair))

# %%
html.provenance([study])
