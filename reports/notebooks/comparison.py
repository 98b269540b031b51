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
# The best learned policy and the best heuristic in the same missions: how far apart they are, where
# in the space of parameters, in which missions the learned one loses, and what a decision costs.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders comparison and timing
learned = None  # the learned policy to show; None for the best of the study
heuristic = None  # the policy to set beside it; None for the best that has not learned

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, numbers
from analysis.execution import decision_time
from analysis.figures import comparison as figures
from analysis.questions import decision_costs, head_to_head, regions, summary
from analysis.questions.missions import kept_missions
from reports.pages import html

# %%
study = load_results(Path(results) / "comparison")
times = decision_time.read(Path(results) / "timing")
pair = head_to_head.pair_of(study, learned, heuristic)
policy, title = pair.policy, f"{pair.policy} − {pair.baseline}"
missions = head_to_head.duels(study, pair)

# %% [markdown]
# ## On the same missions

# %%
html.say(head_to_head.introduction(study, pair, missions))

# %% [markdown]
# Unless another is named, the metric is collection ratio and communication, the product of success
# and collection ratio, in percentage points. Every mission has parameters of its own (Table II) and
# the same realisation of initial data, arrivals and shadowing for both policies: they are compared
# mission by mission. Verdicts are by p-values at the 5 % level, after Holm's correction for the
# number of comparisons and Bonferroni's for the choice of the pair, or of the best policy, by these
# data: ▲ ahead, ▼ behind, ≈ inconclusive. The 95 % intervals are of one difference each.

# %%
learners = head_to_head.learners_against_baseline(study)
comparison = head_to_head.overall(missions, pair)
worth = head_to_head.pairing(comparison)
display(
    html.table(
        head_to_head.by_metric(comparison),
        f"With missions of its own for each policy, it would take {worth} for intervals as narrow",
    ),
    html.table(head_to_head.by_metric(learners, "learner"), "Every learner and the best heuristic"),
    html.table(head_to_head.by_metric(summary.comparisons(study)), "Every policy and the best one"),
)

# %% [markdown]
# Of a learner with several trainings, the interval of the points is a confidence interval of the
# expected difference: of the mean over all trainings that the learner might have. A single training
# may lie outside of it. *One new training* is the 95 % prediction interval of the difference that
# one more training of this learner would have. Of a learner with a single training, the claim is
# about this checkpoint, and nothing is known of another training.
# The rest of this page is about one policy: of several trainings the first, whatever came of it.

# %% [markdown]
# ### Mission by mission
#
# A mission that fails counts 0, so a single failure weighs as much as many small leads. Failures
# are rare because all policies here act under the return guard, which allows only actions after
# which a UAV can still reach the charging zone in time.
#
# In the figure, the 95 % band holds the whole curve. Where the curve crosses 0 is the share of
# missions that are lost. Up to 0.5 % of the missions lie beyond each end of the axis.

# %%
html.table(head_to_head.outcomes(missions, pair), "Outcomes, with 95 % intervals of their shares")

# %%
lowest, highest = (numbers.difference(end, 0) for end in missions["difference"].agg(["min", "max"]))
html.figure(
    figures.distribution(missions, pair),
    f"Distribution of the difference {title} over the missions",
    f"Share of the missions (n = {len(missions):,}) in which the difference is at most the value "
    f"below; the lowest is {lowest} points, the highest {highest}.",
)

# %% [markdown]
# ## Over the space of parameters
#
# Every parameter is cut into at most five bins with about as many missions; the initial data are
# the mean of a mission's nodes. In the figures, blue is ahead, orange behind; what is inconclusive
# (after Holm's correction for all bins) is hollow and grey; dashed is the mean of all missions.

# %%
lead = regions.along(missions, pair.candidates)
html.table(
    regions.spread(lead, regions.dependence(missions)),
    f"{policy} is {regions.tally(lead)} bins. Of every parameter the bins with the lowest and the "
    "highest mean difference [points], the share of the variance that its bins explain, and the "
    "test of equal means (Alexander and Govern, Holm's correction for the number of parameters)",
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
# The two parameters that explain most of the difference, at once: chosen by the missions of even
# replications, drawn from those of odd replications, which had no part in the choice. In brackets:
# inconclusive (p of the paired t test, Holm's correction for all cells).

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
# ## Where it loses
#
# A regression tree cuts the space into regions in which the difference differs most. It is grown on
# one half of the missions, those of even replications, and judged on the other half, which had no
# part in it: else the regions that chance favours would look real. Parameters that are not named
# may have any value. The intervals are at 95 %.

# %%
leaves = regions.rules(missions, pair.candidates)
html.table(regions.listed(leaves, policy), f"{policy} is {regions.tally(leaves)} regions")

# %% [markdown]
# ## The worst missions
#
# Those with the lowest product, of equal ones those with less collected; and of all others those
# in which the policy is furthest behind. Points are the difference in the product. The commands
# simulate a mission of the results folder again and draw it; another `--policy` of the study acts
# in the same mission. The first two are drawn below, by both policies, if their records are still
# the same when simulated again.

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
maps = figures.maps(kept_missions(study, head_to_head.drawn(missions, pair), results))
display(html.say("{commands}", commands=html.commands(lines)), *map(html.gallery, maps))

# %% [markdown]
# ## What a decision costs
#
# A policy is asked once in a mission slot for all UAVs of a mission that must act. Timed is this
# call alone, with all that the policy works out from what it sees, in one mission at a time; and in
# the same missions all at once in the batch engine, where a call decides for many. Times are of one
# machine and will differ on another. Is that fast enough? A decision must be ready within a mission
# slot. The model gives a slot no length in seconds; but in one, a UAV flies a cell: the last column
# is the speed at which it crosses a cell in the time that 95 % of the calls keep below.

# %%
costs = decision_costs.timed(times, study.policies)
alt = "Time of a decision of every policy, for one mission and in the batch"
caption = (
    f"n = {min(cost.calls for cost in costs):,} calls or more per policy. A line goes from the "
    "median to what 95 % of the calls keep below: the spread of the calls, no interval of a mean."
)
display(
    html.say(decision_costs.remarks(times, study, pair)),
    html.figure(figures.decision_time(costs, study.policies), alt, caption),
    html.table(decision_costs.listed(times, costs), "Times of decisions, and the speed they allow"),
)

# %% [markdown]
# ## Where the figures come from

# %%
display(html.provenance([study]), html.table(decision_costs.origin(times), wrap=True))
