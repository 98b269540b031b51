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
# # What if
#
# A question to the simulator, answered now: a baseline of the scenario and a variation of it, flown
# on the same seas and compared mission by mission, with a typical and a bad mission to look at.

# %% tags=["parameters"]
results = "../../results"  # folder in which the results of the question are kept
settings = {"uavs": 5}  # fields of the scenario that the variation sets
baseline = {"uavs": 3}  # fields that are set in both, where the variation does not set its own
scenario = "paper"  # a shipped scenario, or a TOML file
policies = ["ddqn", "greedy"]  # each is compared with itself
missions = 500  # of every policy, in the baseline and in the variation
seed = 0  # of the missions
workers = 1  # processes; more take seconds to start, and pay from thousands of missions on
shown = None  # the policy whose missions are drawn; None for the best in the variation

# %%
import pandas as pd
from IPython.display import Markdown, display

from analysis import fly, numbers
from analysis.figures import missions as figures
from analysis.figures import what_if as what_if_figures
from analysis.names import METRICS, PRODUCT
from analysis.questions import summary as findings
from analysis.questions import what_if
from analysis.stats.intervals import LEVEL
from reports.pages import html

asked = what_if.question(settings, baseline, scenario, policies, missions, seed)
what_if.check_policy(asked, shown or asked.policies[0])
study = what_if.ask(asked, results, workers)

product = PRODUCT
changes = what_if.changes(study)
means, answers = what_if.means(study), what_if.answers(study)
told = answers.set_index(["policy", "metric"])
best = [what_if.best_policy(study, point) for point in (what_if.BASELINE, what_if.VARIATION)]
shown = shown or best[what_if.VARIATION]
n = int(answers["n"].min())
level = f"{100 * LEVEL:g} %"


def code(values):
    """Fields and values in words."""
    return numbers.words([f"`{field}` {value}" for field, value in values.items()])


def amount(value, *ends, sign=""):
    """A number in its unit, and its interval if it has a length."""
    numbers = [round(number, 2) or 0.0 for number in (value, *ends)]  # no -0.0
    shown = [f"{number:{sign if number else ''}.2f}".replace("-", "−") for number in numbers]
    return f"{shown[0]} [{', '.join(shown[1:])}]" if len({*ends}) > 1 else shown[0]


def points(value, low, high):
    """A difference and its interval in percentage points; a short one with two decimals."""
    if 0 < high - low < 0.01:
        return amount(100 * value, 100 * low, 100 * high, sign="+")
    return numbers.points(value, low, high)


def gain(policy, metric):
    """The paired difference of a metric of the paper, in percentage points."""
    return points(*told.loc[(policy, metric), ["difference", "low", "high"]])


# %% [markdown]
# ## The question

# %%
same, drawn = what_if.shared(study), what_if.drawn(study)
listed = numbers.words([f"`{c.field}` = {c.after} instead of {c.before}" for c in changes])
display(
    Markdown(
        f"What if a mission had {listed}?\n\n"
        f"All else is as scenario **{study.manifest['study']['scenario']}** has it"
        + (f", with {code(same)} in both" if same else "")
        + (f". Every mission draws its own {code(drawn)}" if drawn else "")
        + f". {numbers.words([f'**{p}**' for p in study.policies])} flew {n:,} missions each in the "
        f"baseline, and the same {n:,} in the variation: replication by replication, "
        "all that the variation does not set is equal, the sea, the arrivals and the shadowing."
    )
)
html.table(
    pd.DataFrame(changes).rename(
        columns={"field": "Field", "before": "Baseline", "after": "Variation"}
    )[["Field", "Baseline", "Variation"]],
    "What is changed. "
    + " ".join(f"{c.field}: {c.description.split(';')[0].split(':')[0]}." for c in changes),
)

# %% [markdown]
# ## The answer


# %%
def answered(policy):
    """What becomes of a policy, in a sentence."""
    row = told.loc[(policy, product)]
    words = {
        what_if.HIGHER: "is **higher** with",
        what_if.LOWER: "is **lower** with",
        what_if.INCONCLUSIVE: "**cannot be told** to differ with",
    }
    return f"{words[what_if.verdict(row)]} {policy}, {gain(policy, product)} points"


def detailed(policy):
    row = told.loc[(policy, product)]
    return (
        f"- **{policy}**: collection ratio and communication from {numbers.percent(row['before'])} "
        f"to {numbers.percent(row['after'])}; successful communication {gain(policy, 'success')}, "
        f"collection ratio {gain(policy, 'collection_ratio')} points."
    )


def undecided(policy):
    """What it would take to tell, where it cannot be told."""
    row = told.loc[(policy, product)]
    more = what_if.missions_to_tell(row)
    bounds = f"- **{policy}** is undecided: the interval of {gain(policy, product)} points holds 0."
    if more == float("inf"):
        return f"{bounds} How many missions would tell a difference, these do not show."
    number = f"{float(f'{more:.2g}'):,.0f}"
    return (
        f"{bounds} If the difference is as large as seen, some {number} missions would tell it "
        f"{100 * what_if.POWER:g} times in 100, instead of the {n:,} here. Those that are there "
        "are kept: only the others would be flown."
    )


open_for = [
    p for p in study.policies if what_if.verdict(told.loc[(p, product)]) == what_if.INCONCLUSIVE
]


def leading(point):
    """The best policy of a side, with its mean."""
    (row,) = means.query("metric == @product and point == @point and policy == @best[@point]").index
    mean = numbers.interval(*means.loc[row, ["mean", "low", "high"]])
    return f"in the {what_if.SIDES[point]} {best[point]}, {mean}"


taught = [p for those in findings.learners(study).values() for p in those]
caveat = (
    f"\n\nA learned policy flies as it was trained: {numbers.words(taught)} may do better in a "
    "setting like this after training in it. Its model card says what it has learned."
)
display(
    Markdown(
        f"With {listed}, collection ratio and communication "
        + "; it ".join(map(answered, study.policies))
        + f" (the paired difference with its {level} interval).\n\n"
        + "\n".join([*map(detailed, study.policies), *map(undecided, open_for)])
        + (
            f"\n\nThe highest mean: {leading(what_if.BASELINE)}; {leading(what_if.VARIATION)}."
            if len(study.policies) > 1
            else ""
        )
        + (caveat if taught else "")
    )
)

# %%
sides = [
    [f"{change.field} {change.before}" for change in changes],
    [f"{change.field} {change.after}" for change in changes],
]


def beside(metric):
    name = METRICS[metric]
    found = [f"{p} {gain(p, metric)} points" for p in study.policies]
    caption = (
        f"{name}, from the baseline to the variation: {'; '.join(found)}. n = {n:,} missions per "
        f"dot, bars are {level} intervals of the means. These may overlap where the difference "
        "is clear."
    )
    return what_if_figures.means(means, metric, sides), f"{name}, baseline and variation", caption


html.gallery([beside(metric) for metric in METRICS])

# %%
gaps = {policy: what_if.differences(study, policy) for policy in study.policies}


def sorted_out(policy):
    """How many missions gain and lose."""
    own = gaps[policy]
    better, worse = numbers.percent((own > 0).mean()), numbers.percent((own < 0).mean())
    return f"{policy} is better off in {better} of the missions and worse off in {worse}"


uneven = any(what_if.differences(study, p, "success").any() for p in study.policies)
html.gallery(
    [
        (
            what_if_figures.gains(answers),
            "Paired differences of the three metrics with intervals",
            f"The answer: means of the differences of n = {n:,} pairs of missions per policy, "
            f"bars are their {level} intervals. Right of the line, the variation has more.",
        ),
        (
            what_if_figures.spread(gaps),
            "Distribution of the paired differences of collection ratio and communication",
            f"What single missions gain or lose in collection ratio and communication: "
            f"{'; '.join(map(sorted_out, study.policies))}. n = {n:,} pairs per policy, no "
            "interval: these are the missions themselves. "
            + ("Far out lie those where one of the pair failed and counts 0. " if uneven else "")
            + "Below: between the quantiles of "
            f"{numbers.words([f'{50 * (1 + s * what_if_figures.MIDDLE):g} %' for s in (-1, 1)])}.",
        ),
    ]
)

# %% [markdown]
# ### In absolute terms

# %%
marks = {what_if.HIGHER: "▲", what_if.LOWER: "▼", what_if.INCONCLUSIVE: "≈"}
short = {"success": "Success", "collection_ratio": "Collection ratio", product: "Their product"}


def line(row):
    """A measure of both sides, and its difference."""
    ends = (row.difference, row.low, row.high)
    if row.metric in short:
        name, texts = short[row.metric], [numbers.percent(row.before), numbers.percent(row.after)]
        change = f"{points(*ends)} points"
    else:
        name, texts = what_if.MEASURES[row.metric], [amount(row.before), amount(row.after)]
        change = amount(*ends, sign="+")
    return [name, *texts, f"{marks[what_if.verdict(row)]} {change}"]


display(
    Markdown(
        f"Means of {n:,} missions, data in data units, and the mean paired differences with their "
        f"{level} intervals, each by itself: ▲ the whole interval is above 0, ▼ below it, ≈ around "
        "it. A UAV waits while it asks for a charging pad and none is free; it runs dry if its "
        "battery is empty before its quota is filled."
    )
)
for policy in study.policies:
    rows = [line(row) for row in answers[answers["policy"] == policy].itertuples()]
    head = ["Mean per mission", "Baseline", "Variation", "Paired difference"]
    display(html.table(pd.DataFrame(rows, columns=head), policy))

# %% [markdown]
# ### What common random numbers gained


# %%
def paired(policy, metric):
    """What pairing did to the interval of a metric."""
    row = told.loc[(policy, metric)]
    left = 1 - row["variance_reduction"]
    return [
        policy,
        short[metric],
        amount(row["correlation"]),
        numbers.percent(left),
        numbers.percent(1 - left**0.5) if left < 1 else "none",
        f"{n / left:,.0f}" if left else "any number",
    ]


display(
    Markdown(
        "Baseline and variation meet the same seas, so what a sea gives or takes from both drops "
        "out of the difference. A failed mission counts 0 in collection ratio and communication: "
        "where failures come on different seas, there is little to drop out."
    )
)
html.table(
    pd.DataFrame(
        [paired(policy, metric) for policy in study.policies for metric in METRICS],
        columns=["Policy", "Metric", "Correlation", "Variance left", "Narrower by", "Worth"],
    ),
    f"The differences of n = {n:,} pairs beside those of missions on seas of their own: the "
    "correlation of the pairs, the variance as a share of that of independent missions, by how "
    "much the interval is narrower, and how many independent missions it is worth",
)

# %% [markdown]
# ## Two missions to look at

# %%
chosen = {"typical": what_if.typical(study, shown), "bad": what_if.worst(study, shown)}
uavs = study.uavs[study.uavs["policy"] == shown].set_index(["point", "replication"])
fates = {"battery": "ran dry", "truncated": "ran out of time"}


def flown(kind, point):
    """A mission, drawn, with its caption."""
    replication, side = chosen[kind], what_if.SIDES[point]
    flight = fly(study, shown, point, replication)
    record, ends = flight.record, uavs.loc[(point, replication), "end"]
    lost = [
        f"{(ends == e).sum()} of {len(ends)} UAVs {f}" for e, f in fates.items() if e in {*ends}
    ]
    caption = (
        f"{kind.capitalize()} mission, {side} ({', '.join(sides[point])}): collection ratio "
        f"{numbers.percent(record.collection_ratio)}"
        + (f", but {numbers.words(lost)}: it counts 0" if lost else ", all quotas filled")
        + f". {record.slots} mission slots. n = 1 of {n:,} missions: an example, no interval."
    )
    alt = f"Map of a {kind} mission in the {side}; battery, residual data and charging"
    return figures.mission_figure(flight.events, flight.scenario), alt, caption


def shown_beside(kind, why):
    """A mission of the baseline beside that of the variation on the same sea."""
    points, replication = (what_if.BASELINE, what_if.VARIATION), chosen[kind]
    change = numbers.difference(gaps[shown][replication], 0)
    display(
        Markdown(
            f"Replication {replication}: {why} The variation changes collection ratio and "
            f"communication by {change} points here. To fly it again:\n\n"
            + html.commands(
                line
                for p in points
                for line in (f"# {what_if.SIDES[p]}", study.replay(shown, p, replication))
            )
        )
    )
    return html.gallery([flown(kind, point) for point in points])


display(
    Markdown(
        f"Both are missions of **{shown}**"
        + (
            ", the best policy of the variation"
            if shown == best[what_if.VARIATION] and len(study.policies) > 1
            else ""
        )
        + ". Each is shown twice on the same sea: in the baseline and in the variation."
    )
)

# %% [markdown]
# ### A typical one

# %%
shown_beside(
    "typical",
    f"of the {n:,} differences in collection ratio and communication it has the median.",
)

# %% [markdown]
# ### A bad one

# %%
shown_beside(
    "bad",
    f"of the {n:,} missions of the variation it is the worst by collection ratio and "
    "communication, of those alike by collection ratio.",
)

# %% [markdown]
# **How to read the map.** Every sensor node has a colour. An arrow is the move of one mission slot,
# in the colour of the node that was served in most of its communication slots; grey where none was.
# A cross is a slot of hovering, a star a slot of charging. A numbered diamond is where a UAV
# starts, a dot where its mission ends. UAVs that share a path are drawn side by side. y grows
# south.

# %% [markdown]
# ## Ask again, ask more

# %%
display(
    Markdown(
        f"This page is made by\n\n{html.commands([what_if.command(study)])}\n\n"
        "The same question asked again reuses its missions; with more `missions` it flies only "
        "the others. `--set` and the parameter `baseline` take every field of the scenario, in "
        "TOML syntax. In Jupyter, the page's notebook asks what its first cell says.\n\n"
        "To turn the question into a sweep, save this as `my-sweep.toml`, add rows (each is a "
        "variation; the first is the baseline) and run `dess study run my-sweep.toml --out "
        'results/my-sweep`. With `kind = "grid"` and a table `values` of lists in place of the '
        "rows it visits every combination."
        f"\n\n```toml\n{what_if.as_toml(study)}```"
    )
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
