"""The answer for the one who pays, in few sentences: terminal and page tell the same."""

from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.risk import risk_sentence
from dess.analysis.ask.around import one_more_sentence
from dess.analysis.ask.falls import fall_sentences
from dess.analysis.ask.limits import limit_sentences
from dess.analysis.results.tables import Results
from dess.analysis.study.cheapest import Cheapest


def brief_sentences(results: Results) -> list[str]:
    """The risk of the cheapest fleet, what breaks it first, and what one more UAV brings.

    Where one more UAV or pad collects less, they say why.

    Args:
        results: A study. Without a data sheet or a search for the cheapest fleet there are none.
    """
    is_search = isinstance(results.study.selection, Cheapest)
    if not is_search or not all(space.units for space in results.store.manifest.scenarios):
        return []
    best = search_of(results).best
    sentences = [
        risk_sentence(results, best.policy, best.points),
        *limit_sentences(results),
        one_more_sentence(results),
        *fall_sentences(results),
    ]
    return [sentence for sentence in sentences if sentence]
