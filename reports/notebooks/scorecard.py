# ---
# jupyter:
#   dess:
#     studies: [table4, fig4, fig5, sweet-spot]
#     optional: [gap, fig5-paper, sweet-spot-paper]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Which claims of the paper hold?
#
# Every claim of the paper's Sections III-C and V, judged by rules from simulations here.

# %% tags=["parameters"]
results = "../../results"  # folder with the results of table4, fig4, fig5, sweet-spot
trained = None  # folder with the learning curves; None for the shipped ones

# %%
from importlib.resources import files
from pathlib import Path

from IPython.display import display

from dess.analysis import load_results, numbers
from dess.analysis.answers.training.curves import read_curves
from dess.analysis.figures.comparison import plot_claims
from dess.analysis.paper import scorecard, values
from dess.analysis.results.chunks import MANIFEST
from dess.base.files.reading import paths_in
from dess.policies.learner.description import read_description
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.parts import lead_figure, make_answer
from dess.reports.pages.provenance import provenance_table, weights_table
from dess.reports.pages.tables import make_table
from dess.reports.pages.templates import render_part

# %%
folder = Path(str(trained or files("dess.policies") / "trained"))
smaller = paths_in(Path(results), f"*{scorecard.SMALLER}/{MANIFEST}")
names = ("table4", "fig4", "fig5", "sweet-spot", *(path.parent.name for path in smaller))
studies = {name: load_results(Path(results) / name) for name in names}
rows = scorecard.scorecard(studies, read_curves(folder / "curves.parquet"))
against = scorecard.against_paper(rows)

# %%
make_answer(scorecard.scorecard_sentence(rows))

# %%
lead_figure(
    plot_claims(against),
    "Our results minus the numbers that the paper prints, by policy",
    f"n = {numbers.format_span(against['n'])} missions per dot. Bars are 95 % intervals, with that "
    "of the paper's number where the paper says over how many missions it is a mean.",
    against,
    plot_claims(against, width=23),
)

# %% [markdown]
# ## Why
#
# A claim is *diagnostic* if every policy that has learned nothing is shown to fail it: only such
# claims say something about learning. An inconclusive result shows no failure. A number is
# *matched* if the interval of our number minus the paper's reaches 0, and *exceeded* if all of it
# is above. A claim that something is lost is a *weakness*: to have it too is no merit.


# %%
def table(kind: str) -> None:
    if claims_of_kind := scorecard.of_kind(rows, kind):
        values = {"columns": scorecard.policy_names(rows), "caption": scorecard.KINDS[kind]}
        display(render_part("scorecard.html", rows=claims_of_kind, **values))


table(scorecard.DIAGNOSTIC)

# %% [markdown]
# ## How far to trust it
#
# Every interval has its level alone, so some verdicts are wrong by chance. The best learned policy
# is chosen on the missions that judge it. Every number of UAVs that a study draws has the same
# weight in a mean, however often the missions drew it. The paper prints no intervals. Its means
# over a known number of missions have one here, by our spread of the collection ratio; where it
# does not say over how many missions a number is a mean, the number counts as exact. Claims on the
# paper's learner need trainings as long as its own: shorter ones leave them inconclusive.

# %%
write_markdown("{snr}", snr=values.SNR_IN_WORDS)

# %%
make_table(scorecard.count_verdicts(rows), "Verdicts by policy")

# %% [markdown]
# ## Tables

# %%
for kind in (scorecard.PASSED, scorecard.OPEN, scorecard.WEAKNESS, scorecard.UNTESTED):
    table(kind)

# %% [markdown]
# ## How this page was made

# %%
for config in paths_in(folder, f"{scorecard.PAPERS_NETWORK}/config.json"):
    departures = scorecard.departures_in_words(read_description(config.parent).training)
    line = "`{name}` has the paper's observation, network and Algorithm 1, but for {all}."
    shown = numbers.join_words(departures) if departures else "nothing"
    display(write_markdown(line, name=scorecard.PAPERS_NETWORK, all=shown))

# %%
weights_table(folder)

# %%
provenance_table(studies.values())
