"""The figure that shows the answer of a study, whatever its design and question."""

from dess.analysis.answers.fleet.figures import draw_cheapest
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.answers.policies.performance import draw_performance
from dess.analysis.answers.settings.figures import (
    draw_curves,
    draw_main_effects,
    draw_one_at_a_time,
    draw_scatter,
)
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.sobol import draw_indices
from dess.analysis.figures import Drawing
from dess.analysis.results.tables import Results


def draw_main_figure(results: Results, metric: str) -> Drawing:
    """The figure that shows the answer of a study.

    It is the metric over all that the design varies, or what decides a search for a fleet.
    """
    if requirements_of(results):
        return draw_cheapest(results)
    fields = [*varied_values(results)]
    kind = results.design
    if kind == "saltelli":
        return next(draw_indices(results, metric))
    if not fields:
        return draw_performance(results, metric)
    if len(fields) == 1 or (len(fields) == 2 and kind in ("grid", "table")):
        return draw_curves(results, fields[0], next(iter(fields[1:]), None), metric)
    if kind == "one-at-a-time":
        return next(draw_one_at_a_time(results))
    return (draw_scatter if kind == "latin-hypercube" else draw_main_effects)(results, metric)
