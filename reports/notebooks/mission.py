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
# # What does a mission look like?
#
# Where UAVs fly, which nodes they serve and when they charge, slot by slot.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders of the studies fig1 and fig4
policy = None  # the policy to show; None for the best by product
replication = 0  # the replication to show; the study must have stored its event log

# %%
from IPython.display import display

from dess.analysis import load_results, numbers
from dess.analysis.answers import missions
from dess.analysis.answers.policies import ranks
from dess.analysis.metrics import RATIO
from dess.analysis.paper import values
from dess.analysis.results.resimulate import LoggedMission
from dess.base.commands import command_line
from dess.reports.pages.markdown import command_block, write_markdown
from dess.reports.pages.panel import make_another
from dess.reports.pages.parts import Part, make_answer, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table
from dess.reports.player import READING, Shown, join_players, make_player, player_script

# %%
CHOICES = 5  # missions that the first player offers at most; each is 35 kB of the page

fig1, fig4 = (load_results(f"{results}/{name}") for name in ("fig1", "fig4"))
ranked = ranks.rank_policies(fig4.missions)
best = ranks.best_policy(fig1.missions)
shown_policy = policy or ranked[0]
seed = fig4.manifest["seed"]
points = range(len(fig4.manifest["points"]))
shown = [LoggedMission.of(fig4, shown_policy, point, replication) for point in points]
example = LoggedMission.of(fig1, best, 0, replication)

# %%
make_answer(missions.shared_collection_sentence(shown))

# %%
player_script()


# %%
def told(mission: LoggedMission) -> Shown:
    collected = numbers.format_percent(mission.record[RATIO])
    title = f"{mission.fleet}, {mission.policy}: {collected} collected"
    choice = f"replication {mission.replication}"
    return Shown(mission.events, mission.scenario, title, choice)


def played(mission: LoggedMission, name: str) -> Part:
    caption = (
        f"n = 1 mission of {mission.policy}, replication {replication} of seed {seed}, "
        f"{mission.record.slots} mission slots. {mission.causes}"
    )
    return make_player([told(mission)], name, caption)


# %%
stored = range(min(fig4.study.logged, CHOICES))
others = [number for number in stored if number != replication]
choices = [LoggedMission.of(fig4, shown_policy, points[-1], number) for number in others]
caption = (
    f"n = 1 mission of {shown_policy}: replication {replication} of seed {seed} or, by choice, "
    f"another of {len(choices) + 1}. {shown[-1].causes}"
)
make_player([told(shown[-1]), *map(told, choices)], "player", caption)

# %% [markdown]
# ## How to read it

# %%
write_markdown("{reading}", reading=READING)

# %% [markdown]
# On the maps, an arrow is a move in one slot, in the colour of the node that was served most, or
# grey. A cross is hovering, a star charging, a numbered diamond the start, a dot the end.

# %% [markdown]
# ## Another mission
#
# With other settings, another policy or another number.

# %%
space, given = fig4.scenario(points[-1]), fig4.given_values(points[-1])
make_another(space, fig4.study.scenario, [shown_policy], seed, given)

# %% [markdown]
# ## Two policies in step
#
# The same mission with the best policy and with the next one.

# %%
second = next((other for other in ranked if other != shown_policy), shown_policy)
other = LoggedMission.of(fig4, second, points[-1], replication)
join_players([played(shown[-1], "player-first"), played(other, "player-second")])

# %% [markdown]
# ## With fewer UAVs

# %%
display(*(played(mission, f"player-{mission.scenario.uavs}") for mission in shown[:-1]))

# %% [markdown]
# ## <a id="fig-4"></a>The paper's Fig. 4
#
# The missions have the same initial data, arrivals and shadowing; only the number of UAVs differs.

# %%
make_gallery(
    missions.beside_paper(fig4, mission, values.FIG_4[mission.scenario.uavs][RATIO])
    for mission in shown
)

# %% [markdown]
# ## The paper's Fig. 1
#
# The paper draws a small map without numbers. The policies that have learned on the paper's map
# work on that map only, so a heuristic is shown.

# %%
caption = (
    f"n = 1 mission of {best}, replication {replication} of seed {fig1.manifest['seed']}: "
    f"{example.record.slots} mission slots, {example.collected}. {example.causes}"
)
alt = "Map of the mission; battery, residual data and charging"
make_gallery([missions.draw_mission(example, alt, caption)])

# %% [markdown]
# ## How far to trust it
#
# Each is a single mission: an example, not an average. The captions of Fig. 4 have the means.

# %% [markdown]
# ## Tables

# %%
make_table(missions.outcome_table(shown), "The missions; data in data units")

# %% [markdown]
# ## How this page was made
#
# These commands simulate the missions again:

# %%
which = {"policy": shown_policy, "seed": seed, "replication": replication}
commands = [
    command_line("simulate", scenario=fig4.study.scenario, set={"uavs": m.scenario.uavs}, **which)
    for m in shown
]
write_markdown("{commands}", commands=command_block(commands))

# %%
provenance_table([fig1, fig4])
