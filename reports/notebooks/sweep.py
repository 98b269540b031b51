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
# # Which setting is the best?
#
# Every combination of values of some fields, for every policy.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "paper"  # a shipped scenario, or a TOML file
fields = {"uavs": [1, 2, 3, 4], "pads": [1, 2, 4]}  # a field with one value is fixed
policies = ["greedy", "nearest"]
missions = 200  # number of missions of every setting
seed = 0  # seed of the missions
workers = 1  # processes; more than one is worth its start time from thousands of missions on
yes = False  # True if the missions may take more than an hour

# %%
from dess.analysis import sweep
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import best_of_policies_table
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.reports.pages import study
from dess.reports.pages.markdown import command_block, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_facts, make_gallery, show_parts
from dess.reports.pages.provenance import provenance_table

# %%
answer = sweep(scenario, policies, missions, seed, results, workers, yes=yes, **fields)

of_fields = " and ".join([*varied_values(answer.results)][:2])
each = f"n = {missions:,} missions per setting"
drawn = {
    metric: (answer.plot(metric=metric), f"{name} by {of_fields}", f"{each}; 95 % intervals.")
    for metric, name in METRICS.items()
}

# %%
make_answer(answer.headline())

# %%
lead_figure(*drawn[PRODUCT])

# %%
make_facts(answer.facts())

# %%
study.make_panel_of(answer.results, PRODUCT)

# %% [markdown]
# ## Why

# %%
make_gallery([drawn[SUCCESS], drawn[RATIO]])

# %% [markdown]
# ## How far to trust it
#
# All settings have the same random draws, so they are compared mission by mission. A setting may be
# the best if no other one is significantly better. Waits for a pad are planned, unless
# `charging.plan_waits` is false.

# %%
show_parts(*answer.shown_tables())

# %% [markdown]
# ## Tables

# %%
show_parts(best_of_policies_table(answer.results, PRODUCT))

# %% [markdown]
# ## Change the question
#
# In Jupyter, change the first cell and run all cells: stored missions are not simulated again. This
# command makes a page with more details. With `prices` and `requirements`, a sweep searches for the
# cheapest fleet ([own sea](own-sea.html)).

# %%
write_markdown("{lines}", lines=command_block([answer.command]))

# %% [markdown]
# ## How this page was made

# %%
write_markdown("{simulated}", simulated=study.list_simulated(answer.results))

# %%
provenance_table([answer.results])
