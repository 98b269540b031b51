# ---
# jupyter:
#   dess:
#     studies: [comparison]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Learned against heuristic
#
# This page compares the best learned policy and the best heuristic in the same missions: how much
# they differ, for which parameters and in which missions, and how long their decisions take.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folder comparison
learned = None  # the learned policy to show; None for the best of the study
heuristic = None  # the policy to compare it with; None for the best that is not learned

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, numbers
from analysis.figures import comparison as figures
from analysis.figures.missions import mission_figure
from analysis.questions import decision_times, head_to_head, regions, summary
from analysis.questions.missions import kept_missions
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "comparison")
times = decision_times.read(results, study)
pair = head_to_head.pair_of(study, learned, heuristic)
policy, title = pair.policy, f"{pair.policy} − {pair.baseline}"
missions = head_to_head.duels(study, pair)

# %% [markdown]
# ## Differences in the same missions

# %%
html.say("{text}", text=html.composed(head_to_head.introduction(pair, len(missions))))

# %% [markdown]
# Unless another metric is named, differences are in collection ratio and communication (the product
# of success and collection ratio), in percentage points. Every mission draws its own parameters
# (Table II), and both policies meet the same initial data, arrivals and shadowing, so they are
# compared mission by mission. ▲ means significantly better, ▼ significantly worse, ≈ inconclusive
# (p-values at the 5 % level, corrected for the number of comparisons by Holm and for choosing the
# policies by these data by Bonferroni). Each 95 % interval is for a single difference.

# %%
comparison = head_to_head.overall(study, pair)
found = {
    f"Worth {head_to_head.pairing(comparison)} independent missions": comparison,
    "Every learner and the best heuristic": summary.learned_against_heuristic(study),
    "Every policy and the best one": summary.comparisons(study),
}
for caption, rows in found.items():
    if len(rows):
        shown = tables.compared(rows, rows.columns[0])
        display(html.table(shown, f"Minus {rows['baseline'].iloc[0]}. {caption}", data=rows))

# %% [markdown]
# For a learner with several trainings, the confidence interval is about the expected difference:
# the mean over all trainings that the learner might have. *One new training* is the 95 % prediction
# interval of the product for one more training. For a learner with a single training, the result is
# only about this checkpoint. The rest of this page is about one policy, which is the first of
# several trainings.

# %% [markdown]
# ### Mission by mission
#
# A failed mission counts 0, so a single failure has as much weight as many small differences.
# Failures are rare because all policies here act under the return guard, which allows only actions
# after which a UAV can still reach the charging zone in time. In the figure, the 95 % band is for
# the complete curve, whose height at 0 is the share of missions in which the policy is not better.
# Up to 0.5 % of the missions are beyond each end of the axis.

# %%
html.table(head_to_head.outcomes(missions, pair), "Outcomes, with 95 % intervals of their shares")

# %%
lowest, highest = (numbers.difference(end, 0) for end in missions["difference"].agg(["min", "max"]))
html.figure(
    figures.distribution(missions, pair),
    f"Distribution of the difference {title} over the missions",
    f"Share of the missions (n = {len(missions):,}) in which the difference is at most the value "
    f"on the axis; the lowest is {lowest} points, the highest {highest}.",
)

# %% [markdown]
# ## Differences by parameter
#
# The values of every parameter are divided into at most five bins with about equally many missions
# (for initial data, by the mean over the nodes). Blue means better, orange worse, hollow grey
# inconclusive (Holm's correction for all bins). The dashed line is the mean of all missions.

# %%
lead = regions.along(missions, pair.candidates)
html.table(
    regions.spread(lead, regions.dependence(missions)),
    f"{policy} is {regions.tally(lead)} bins. For every parameter: the bins with the lowest and "
    "the highest mean difference [points], the share of the variance that its bins explain, and "
    "the test of equal means (Alexander and Govern, Holm's correction)",
)

# %%
html.gallery(
    [
        (
            figures.lead(lead, field, missions["difference"].mean()),
            f"Mean difference {title} against {field}",
            f"{title}, n = {numbers.span(bins['n'])} missions per dot. Bars are 95 % intervals.",
        )
        for field, bins in lead.groupby("field", sort=False)
    ]
)

# %% [markdown]
# The next figure shows the two parameters that explain most of the difference. They were chosen by
# the missions of even replications; the figure shows the others. Brackets mean inconclusive.

# %%
chosen, cells = regions.strongest(missions, pair.candidates)
if len(cells):
    alt = f"Mean difference {title} over {numbers.words([*chosen['field']])}"
    shares = numbers.words([*map(numbers.percent, chosen["explained"])])
    caption = (
        f"{policy} is {regions.tally(cells)} cells, n = {numbers.span(cells['n'])} missions each. "
        f"The lowest mean [points]: {regions.lowest(cells)}. "
        f"In the other half, these explain {shares} of the variance."
    )
    display(html.figure(figures.heat(cells, *chosen["field"]), alt, caption))

# %% [markdown]
# ## Regions in which the policy is better or worse
#
# A regression tree divides the parameter space into regions with different mean differences. It is
# fitted to one half of the missions (even replications), and the means are computed from the other
# half, which was not used for the fit. Parameters that are not named may have any value.

# %%
leaves = regions.rules(missions, pair.candidates)
html.table(regions.listed(leaves, policy), f"{policy} is {regions.tally(leaves)} regions")

# %% [markdown]
# ## The worst missions
#
# The first table has the missions with the lowest product, the second one other missions with the
# largest differences in the product. The commands simulate a mission of the results folder again
# and draw it; another `--policy` of the study acts in the same mission. The first two are drawn
# below for both policies, if their records are the same when simulated again.

# %%
worst = head_to_head.worst(missions, 5)
lost = head_to_head.most_lost(missions.drop(worst.index), 5)
depleted = head_to_head.depleted(study, policy, worst["replication"])
caption = f"The worst of {policy}; in these, the batteries of {depleted} of its UAVs are depleted"
display(
    html.table(head_to_head.listed(worst, study, pair), caption),
    html.table(head_to_head.listed(lost, study, pair), f"The greatest losses to {pair.baseline}"),
)

# %%
lines = head_to_head.commands(study, policy, [*worst["replication"], *lost["replication"]])
kept = kept_missions(study, head_to_head.drawn(missions, pair), results)
maps = [
    (
        mission_figure(mission.log, mission.scenario),
        f"Map of mission {mission.row['replication']} by {mission.row['policy']}",
        mission.caption,
    )
    for mission in kept
]
display(html.say("{commands}", commands=html.commands(lines)), html.gallery(maps))

# %% [markdown]
# ## The time of a decision
#
# In every mission slot, a policy is called once for all UAVs of a mission that must act. Times
# depend on the machine. A decision must be ready within a mission slot, in which a UAV flies one
# cell. The model does not define the length of a slot in seconds, so the last column gives the
# speed at which a UAV crosses a cell in the time of a slow call (95 % quantile).

# %%
display(
    html.table(decision_times.listed(times, study), "Times of decisions, and the speed they allow"),
    html.say("{remarks}", remarks=decision_times.remarks(times, study, pair)),
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
