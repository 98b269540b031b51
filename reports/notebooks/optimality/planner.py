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
# # Planner against learner
#
# This page compares a policy that plans with one that has learned, in the same missions: which is
# better, where, how much time its decisions take, and how far both are from the best possible.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folder gap
planner = "planner"  # the policy that plans
longer = "planner-long"  # the same with a longer search, if the study has it
learner = "ddqn"  # the policy that has learned

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, numbers
from analysis.figures import comparison as figures
from analysis.figures import fronts, learning
from analysis.figures import missions as maps
from analysis.questions import decision_times, head_to_head, regions
from analysis.questions.optimality import gap
from analysis.questions.optimality import planner as questions
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "gap")
times = decision_times.read(results, study)
planners = [name for name in (planner, longer) if name in study.policies]
differences = questions.differences(study, planners, learner)
gaps = gap.by_fleet(study)
pair = head_to_head.pair_of(study, planner, learner)
missions = head_to_head.duels(study, pair)
logged = study.manifest["study"]["logged"]

# %%
html.say("{answer}", answer=html.composed(questions.answer(differences, planner)))

# %%
html.say("{gap}", gap=html.composed(gap.in_words(study, planners[-1])))

# %% [markdown]
# ## Differences by number of UAVs
#
# All policies meet the same missions, so they are compared mission by mission.

# %%
by_product = differences[differences["metric"] == "collection_ratio_and_communication"]
html.figure(
    figures.differences(by_product),
    f"Paired differences from {learner} in the product, by number of UAVs",
    f"n = {numbers.span(by_product['n'])} missions; bars are 95 % intervals.",
    by_product,
)

# %%
html.table(
    tables.estimates(
        differences.assign(mean=differences["difference"]),
        ["policy", "uavs", "n"],
        write=numbers.points,
    ),
    f"Paired differences from {learner} in percentage points, with 95 % intervals",
    data=differences,
)

# %% [markdown]
# ## How far from the best possible
#
# For every mission, an upper bound was computed on what any policy can expect to collect in it.
# The gap is the bound minus the product of a policy, over the same missions. The best possible
# policy is somewhere between the best policy here and the bound.

# %%
html.figure(
    figures.gaps(gaps),
    "The product of every policy and the upper bound, by number of UAVs",
    f"n = {numbers.span(gaps['n'])} missions; bars and the grey band are 95 % intervals.",
)

# %%
html.table(gap.listed(gaps), "Means with 95 % intervals, and the gap in points", data=gaps)

# %% [markdown]
# ## Where each of them wins
#
# The values of every parameter are divided into at most five bins with about equally many missions.
# Blue means that the planner is better, orange that the learner is, hollow grey inconclusive
# (Holm's correction for all bins). The dashed line is the mean of all missions.

# %%
lead = regions.along(missions, pair.candidates)
html.gallery(
    [
        (
            figures.lead(lead, field, missions["difference"].mean()),
            f"Mean difference {planner} − {learner} against {field}",
            f"{planner} − {learner}, n = {numbers.span(bins['n'])} missions per dot.",
        )
        for field, bins in lead.groupby("field", sort=False)
    ]
)

# %% [markdown]
# ### Which nodes they serve

# %%
first, second = (questions.coverage(study, policy) for policy in (planner, learner))
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

# %% [markdown]
# ### When each of them goes home

# %%
home = questions.at_home(study, [planner, learner])
rows = home.assign(panel=0, **dict.fromkeys(("mean", "low", "high"), home["share"]))
html.figure(
    learning.courses(rows, "policy", "%", {0: "Share of the UAVs in the charging zone"}),
    "The share of the UAVs in the charging zone over the slots of the mission",
    f"n = {logged} missions. A UAV that has filled its quota has left the mission.",
    home,
)

# %%
html.table(
    questions.returns(study, [planner, learner]),
    f"Means over charging sessions of the same {logged} missions",
)

# %% [markdown]
# ## Decision time against quality
#
# Times are medians of deciding for the UAVs of one mission, on one core. Policies on the line are
# not dominated. A planner is much slower in the first slot, in which it makes a new plan.

# %%
points = questions.front(study, times)
html.figure(
    fronts.decision_times(points, questions.mean_bound(study)),
    "Decision time against the product of all policies, and their Pareto front",
    f"n = {len(missions):,} missions per policy; bars are 95 % intervals of the product.",
    points,
)

# %%
display(
    html.table(decision_times.listed(times, study), "Times of decisions, and the speed they allow"),
    html.say("{remarks}", remarks=decision_times.remarks(times, study, pair)),
)

# %% [markdown]
# ## One mission: the plan, and which data are worth fetching
#
# The price of a node says what one more data unit there would add to the bound. Where it is near 1,
# the data are worth fetching; where it is 0, more data there would not raise the bound.

# %%
mission = questions.example(study, planner)
replication = int(mission.row["replication"])
courses = questions.plan(study, planner, replication)
plan = maps.plan(mission.log, mission.scenario, courses)
values, title = questions.node_prices(study, replication), "Price of a node's data"
prices = maps.node_map(nodes, title, values, write="{:.2f}".format)

# %%
caption = f"n = 1, mission {replication}: data units that one more data unit would add to the bound"
html.gallery(
    [
        (plan, "The plan of the first slot, over the mission as simulated", mission.caption),
        (prices, "The price of every node's data in the bound of the same mission", caption),
    ]
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
