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
# # What changes if some settings change?
#
# A baseline and a variation of it, with the same random draws.

# %% tags=["parameters"]
results = "../../results"  # folder in which the results of the question are kept
settings = {"uavs": 5}  # fields of the scenario that the variation sets
baseline = {"uavs": 3}  # fields that are set in both, where the variation does not set its own
scenario = "paper"  # a shipped scenario, or a TOML file
policies = ["planner-short", "greedy"]  # None: the best that five minutes allow, and greedy
missions = 300  # number of missions of every policy, in the baseline and in the variation
seed = 0  # seed of the missions
workers = 1  # processes; more than one is worth its start time from thousands of missions on
prices = None  # such as {"uav": 20_000}: then costs are compared as well
yes = False  # True if the missions may take more than an hour
shown = None  # the policy whose missions are drawn; None for the best in the variation

# %%
from IPython.display import display

from dess.analysis import metrics, tables, what_if
from dess.analysis.answers import summary
from dess.analysis.answers.policies import comparisons
from dess.analysis.answers.sides import measured_columns
from dess.analysis.metrics import metric_of
from dess.reports.pages import study as page
from dess.reports.pages.markdown import code_block, command_block, escape_sentences, write_markdown
from dess.reports.pages.panel import make_panel
from dess.reports.pages.parts import lead_figure, make_answer, make_facts, make_gallery, show_parts
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
question = settings, baseline, scenario, policies, missions, seed, results, workers
asked = what_if(*question, prices=prices, shown=shown, yes=yes)
found = asked.results
variation = asked.variation

# %%
make_answer(asked.headline())

# %%
pairs = f"n = {missions:,} pairs per policy"
caption = f"{variation.finding()}{pairs}; {tables.BARS}"
lead_figure(variation.plot(), "Paired differences of the metrics", caption)

# %%
make_facts(asked.facts())

# %%
sides = found.scenario(0), found.scenario(1)
given, costs = found.given_values(0), found.study.costs
make_panel(*sides, scenario, found.policies, seed, given=given, costs=costs)

# %% [markdown]
# ## Why

# %%
extended = [metric for metric in measured_columns(found) if found.missions[metric].any()]
caption = f"n = {missions:,} missions per dot; bars are 95 % intervals of the means."

# %%
spread = f"{variation.spread_in_words()}{pairs}."
spread += " The lower panel ends at the 5 % and 95 % quantiles."
make_gallery(
    [
        (variation.plot_spread(), "Distribution of the paired differences of the product", spread),
        *(
            (
                variation.plot_means(metric),
                f"{metric_of(metric).name}, baseline and variation",
                f"{variation.finding(metric)}{caption}",
            )
            for metric in (*metrics.METRICS, *extended)
        ),
    ]
)

# %% [markdown]
# ## A typical mission and the worst
#
# The first has the median difference of the product, the second the lowest product in the
# variation; each in the baseline and in the variation, by the policy that is best there.

# %%
examples = variation.typical(), variation.worst()
make_gallery([drawing for example in examples for drawing in example.drawings()])

# %% [markdown]
# ## How far to trust it
#
# A difference is inconclusive if its interval contains 0; intervals of the means may overlap
# although the paired difference is clear. A learned policy is used as it was trained: in a setting
# far from its training, a new training may do better.

# %%
write_markdown(
    "{why} {weights}\n\n{notes}",
    why=comparisons.allowance_for_difference(variation.table(), "policy"),
    weights=summary.weights_in_words(found),
    notes=page.list_notes(found),
)

# %%
make_table(
    variation.pairing(),
    f"What common random numbers gain in the differences of n = {missions:,} pairs: the variance "
    "that is left of that of independent missions, and how many of these would be as precise",
)

# %% [markdown]
# ## Tables

# %%
show_parts(*asked.shown_tables())

# %% [markdown]
# ## Change the question
#
# The first command makes this page again, with more missions or other values of `--set`. The TOML
# lines are the same question as a study: every further row is another variation.

# %%
command = command_block([asked.command])
study = code_block("toml", variation.as_toml().rstrip("\n"))
write_markdown("{command}\n\n{study}", command=command, study=study)

# %% [markdown]
# ## How this page was made

# %%
name = found.manifest["study"]["scenario"]
make_table(variation.field_table(), f"Scenario {name}, {missions:,} missions of each policy")

# %%
for example in examples:
    lines = command_block(example.commands())
    display(
        write_markdown(
            "{effect}\n\n{lines}", effect=escape_sentences(example.effect()), lines=lines
        )
    )

# %%
provenance_table([found])
