# ---
# jupyter:
#   dess:
#     studies: [seas]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How good are the policies on any sea?
#
# Every policy on seas of seven families that no policy has learned on, beside its time.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folder seas
policy = "any"  # the learned policy for any sea
reference = "planner"  # a slow policy that is hard to beat
heuristic = "greedy"  # a fast policy without learning

# %%
from pathlib import Path

from analysis import load_results, tables
from analysis.answers import comparison as answers
from analysis.answers import seas
from analysis.figures import comparison, settings
from analysis.metrics import METRICS, PRODUCT, SUCCESS
from reports.pages import html

# %%
study = load_results(Path(results) / "seas")
for name in (policy, reference, heuristic):
    study.check_policy(name)
times = answers.read(results, study)
shares = {by: seas.shares(study, reference, by) for by in seas.GROUPS}
gains = {by: seas.gains(study, heuristic, by) for by in seas.GROUPS}

# %%
html.answer(seas.answer(study, times, policy, reference, heuristic))

# %%
points = seas.front(study, times)
html.lead(
    settings.decision_times(points),
    "Time of a decision against the product over all seas, and the Pareto front",
    f"n = {points['n'].max()} seas; bars are 95 % intervals over seas. Times are those of a "
    "decision for a UAV on one core, many missions side by side.",
    points,
)

# %% [markdown]
# ## Why: what each family asks for

# %%
html.gallery(
    [
        (
            comparison.groups(shares[by], by, f"product, share of {reference}"),
            f"The product as a share of that of {reference}, by {name.lower()}",
            f"n = {shares[by]['n'].min()} seas and more per dot; bars are 95 % intervals.",
            shares[by],
        )
        for by, name in seas.GROUPS.items()
    ]
)

# %% [markdown]
# ## How far to trust it
#
# A sea counts once, with the mean of its missions, and all policies meet the same missions. The
# seas are drawn with seeds that no training and no selection of weights has used.

# %%
html.table(
    seas.worst(study, policy, reference),
    f"The seas on which {policy} is the farthest behind {reference}",
)

# %% [markdown]
# ## Tables

# %%
html.table(
    seas.summary(study, times),
    "Every policy over all seas, and the time of a decision in batches on one core",
)

# %%
for by, name in seas.GROUPS.items():
    rows = seas.quality(study, by)
    html.table(
        tables.estimates(rows, [by], "policy"),
        f"{METRICS[PRODUCT]} by {name.lower()}: means over seas with 95 % intervals",
        data=rows,
    )

# %%
rows = seas.quality(study, "family", SUCCESS)
html.table(
    tables.estimates(rows, ["family"], "policy"),
    f"{METRICS[SUCCESS]} by family: means over seas with 95 % intervals",
    data=rows,
)

# %%
differences = gains["family"].assign(mean=gains["family"]["difference"])
html.table(
    tables.estimates(differences, ["family"], "policy", tables.numbers.points),
    f"Points of the product more than {heuristic}, paired, with 95 % intervals",
    data=differences,
)

# %% [markdown]
# ## How this page was made

# %%
html.provenance([study])
