"""The kept page that has what the checks measured."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from dess.analysis import numbers
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import HOLDS
from tests.verification.checks import ALPHA, reason_in_words
from tests.verification.suite import Suite

KEPT = Path(__file__).with_name("kept")
# The text of the page, with a place for each part that is measured.
TEXT = Path(__file__).with_name("page.md")


def render_page(suite: Suite, judged: pd.DataFrame, block: int) -> str:
    """The page as Markdown.

    Args:
        suite: What is checked.
        judged: The verdicts on its checks.
        block: Number of missions in a block.
    """
    study = suite.study.study
    return TEXT.read_text("utf-8").format(
        missions=f"{study.missions:,}",
        policies=_code_names(study.policies),
        logs=f"{study.logged:,}",
        holding=(judged["verdict"] == HOLDS).sum(),
        count=len(judged),
        exact=judged["error"].count(),
        statistical=judged["p"].count(),
        level=numbers.format_level(ALPHA),
        seeds=f"{1 / ALPHA:.0f}",
        studies=_code_names(suite.studies),
        block=block,
        best=_code_names([suite.best]),
        checks=_check_table(judged),
        rates=_rate_table(suite.rates),
    )


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    cells = [heads, ["---"] * len(heads), *rows]
    lines = (" | ".join(cell.replace("|", "\\|") for cell in row) for row in cells)
    return "\n".join(f"| {line} |" for line in lines)


def _check_table(judged: pd.DataFrame) -> str:
    heads = ["part", "test", "verdict", "known", "seen", "p-value or error", "n"]
    rows = [
        [
            *(row[name] for name in ("topic", "test", "verdict", "known", "seen")),
            *(reason_in_words(row), f"{row['n']:,}"),
        ]
        for _, row in judged.iterrows()
    ]
    return markdown_table(heads, rows)


def _rate_table(rates: pd.DataFrame) -> str:
    heads = ["distance [m]", "simulated", "by integration", "standard errors apart", "n"]
    rows = [
        [
            *(f"{row.distance:,.0f}", f"{row.mean:.6f}", f"{row.known:.6f}"),
            *(numbers.format_minus(f"{(row.mean - row.known) / row.error:+.2f}"), f"{row.n:,}"),
        ]
        for row in rates.itertuples()
    ]
    return markdown_table(heads, rows)


def _code_names(names: Iterable[str]) -> str:
    return numbers.join_words([f"`{name}`" for name in names])


def studies_by_name(results: Iterable[Results]) -> dict[str, Results]:
    """Results by the names of their studies."""
    return {of_study.study.name: of_study for of_study in results}
