from collections import Counter

import numpy as np
import pytest
import tomli_w
from pydantic import BaseModel, ConfigDict, ValidationError
from scipy.stats import qmc

from dess import InputError
from dess.analysis.study.design import MAX_SIZE, Design, GridDesign, LatinHypercube, Saltelli
from dess.base.errors import to_input_error
from dess.base.files.reading import parse_toml
from dess.physics.streams import MAX_REPLICATION, MAX_SEED
from dess.scenario.families import seas_of
from dess.scenario.scenario import load_scenario


class Plan(BaseModel):
    """What holds a design, as a study does."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    design: Design = GridDesign()


def plan(text):
    return Plan.model_validate(parse_toml(text, "plan")).design


def values_of(design):
    return [point.values for point in design.points]


TOML = {
    "grid": """
        [design]
        kind = "grid"
        values = {quota = [300, 440], initial_data = [[5, 7.5], [7.5, 10]]}
        """,
    "one-at-a-time": """
        [design]
        kind = "one-at-a-time"
        [design.values]
        uavs = [1, 2, 3]
        initial_data = [5, [7.5, 10]]
        """,
    "table": """
        [design]
        kind = "table"
        rows = [{uavs = 1, initial_data = [5, 10]}, {uavs = [1, 2]}, {}]
        """,
    "latin-hypercube": """
        [design]
        kind = "latin-hypercube"
        ranges = {uavs = [1, 3], pads = [1, 16], arrival_rate = [0, 0.1]}
        size = 20
        """,
    "saltelli": """
        [design]
        kind = "saltelli"
        ranges = {charge_start = [10, 50], initial_data = [5, 20]}
        base = 4
        replications = 1000
        """,
}


@pytest.mark.parametrize("kind", TOML)
def test_every_kind_is_written_in_toml_and_makes_scenarios(kind):
    design = plan(TOML[kind])
    assert design.kind == kind
    assert design.points
    assert design.count == len(design.points)
    for point in design.points:
        load_scenario("paper", **point.values)
        hash(tuple(point.values.values()))  # values group missions
    written = tomli_w.dumps(Plan(design=design).model_dump(mode="json"))
    assert plan(written) == design
    assert plan(written).points == design.points


def test_a_grid_is_the_product_with_the_last_field_fastest():
    assert values_of(plan(TOML["grid"])) == [
        {"quota": 300, "initial_data": (5, 7.5)},
        {"quota": 300, "initial_data": (7.5, 10)},
        {"quota": 440, "initial_data": (5, 7.5)},
        {"quota": 440, "initial_data": (7.5, 10)},
    ]


def test_one_at_a_time_fixes_one_field_per_point():
    assert values_of(plan(TOML["one-at-a-time"])) == [
        {"uavs": 1},
        {"uavs": 2},
        {"uavs": 3},
        {"initial_data": 5},
        {"initial_data": (7.5, 10)},
    ]


def test_a_set_of_seas_has_a_point_for_each():
    design = plan('[design]\nkind = "seas"\nset = "validation"')
    assert values_of(design) == [{"scenario": name} for name in seas_of("validation")]
    assert design.count == len(design.points)


def test_a_latin_hypercube_has_one_point_per_stratum_of_every_field():
    size, ranges = 50, {"edge_snr": (-30, -20), "arrival_rate": (0.0, 0.1)}
    points = values_of(LatinHypercube(ranges=ranges, size=size))
    strata = {
        field: [int((values[field] - low) / (high - low) * size) for values in points]
        for field, (low, high) in ranges.items()
    }
    for numbers in strata.values():
        assert sorted(numbers) == list(range(size))
    assert strata["edge_snr"] != strata["arrival_rate"]


def test_integers_are_equally_frequent_both_ends_included():
    design = LatinHypercube(ranges={"uavs": (1, 3), "pads": (5, 10)}, size=300)
    for field, (low, high) in design.ranges.items():
        drawn = [values[field] for values in values_of(design)]
        assert {type(value) for value in drawn} == {int}
        number = high - low + 1
        assert Counter(drawn) == dict.fromkeys(range(low, high + 1), 300 // number)


def test_the_far_end_of_the_unit_interval_stays_in_the_range(monkeypatch):
    # Strata of a Latin hypercube are open below and closed above: 1.0 is a possible draw.
    monkeypatch.setattr(qmc.LatinHypercube, "random", lambda self, n: np.ones((n, self.d)))
    ranges = {"uavs": (1, 3), "edge_snr": (-0.1, 0.2)}
    (values,) = values_of(LatinHypercube(ranges=ranges, size=1))
    assert values == {"uavs": 3, "edge_snr": 0.2}


@pytest.mark.parametrize(("kind", "size"), [(LatinHypercube, "size"), (Saltelli, "base")])
def test_a_sample_depends_on_its_seed_alone(kind, size):
    def points(seed):
        return kind(ranges={"edge_snr": (0, 1)}, seed=seed, **{size: 4}).points

    samples = []
    for seed in (0, 1, 2, MAX_SEED):
        np.random.seed(3)  # numpy's own state must not matter
        samples.append(points(seed))
        assert points(seed) == samples[-1]
        assert samples[-1] not in samples[:-1]
    assert kind(ranges={"edge_snr": (0, 1)}, **{size: 4}).points == samples[0]


def saltelli(**changes):
    ranges = {"edge_snr": (0, 1), "arrival_rate": (0, 1)}
    return Saltelli(**({"ranges": ranges, "base": 8, "seed": 0} | changes))


def test_saltelli_blocks_are_a_then_one_factor_from_b_each_then_b():
    design = saltelli()
    rows = [(*point.values.values(), point.replication) for point in design.points]
    assert len(rows) == 8 * (3 + 2)
    for start in range(0, len(rows), 5):
        a, *mixed, b = rows[start : start + 5]
        assert all(x != y for x, y in zip(a, b, strict=True))
        for factor, row in enumerate(mixed):
            assert row == (*a[:factor], b[factor], *a[factor + 1 :])


def test_the_noise_is_a_factor_over_all_replications():
    number = 4
    replications = [point.replication for point in saltelli(base=64, replications=number).points]
    assert all(type(replication) is int for replication in replications)
    for sample in (replications[0::5], replications[4::5]):  # A and B
        assert Counter(sample) == dict.fromkeys(range(number), 16)


HEAD = 'ranges = {arrival_rate = [0, 1]}\nkind = "'
BAD = {
    "[design]\nkind = 'sobel'": ["kind: 'sobel' is unknown", "latin-hypercube, saltelli"],
    "kind = 'grid'\nvalues = {uavs = []}": ["grid: values: uavs has no values"],
    "kind = 'table'\nrows = []": ["table: rows: ", "too short"],
    HEAD + f'latin-hypercube"\nsize = {MAX_SIZE + 1}': ["size: ", f"1..{MAX_SIZE:,}"],
    HEAD + 'saltelli"\nbase = 24': ["saltelli: base: 24 is not a power of two; allowed: 1, 2, 4"],
    HEAD + f'saltelli"\nbase = 4\nreplications = {MAX_REPLICATION + 2}': ["replications: "],
}
NO_RANGES = {
    "uavs = [3, 1]": "uavs: [3, 1]",
    "uavs = [1, 2.5]": "uavs: [1, 2.5]",
    "arrival_rate = [false, true]": "arrival_rate: [False, True]",
    f"arrival_rate = [0, {10**400}]": "arrival_rate: [0, 10000",
}
BAD |= {
    f"kind = 'latin-hypercube'\nsize = 8\nranges = {{{text}}}": [
        f"ranges: {what}",
        "is not a range",
    ]
    for text, what in NO_RANGES.items()
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_design_gets_one_line(text):
    with pytest.raises(ValidationError) as error:
        plan(text if "design" in text else f"[design]\n{text}")
    line = str(to_input_error(error.value, "plan", Plan))
    assert line.startswith("plan: design: ")
    assert "\n" not in line
    for part in BAD[text]:
        assert part in line


def test_a_grid_of_very_many_points_is_counted_without_making_them():
    values = {field: range(1, 1001) for field in ("quota", "max_slots", "cell_size", "altitude")}
    design = GridDesign(values={field: tuple(of_field) for field, of_field in values.items()})
    assert design.count == 10**12
    with pytest.raises(InputError, match="design: 1,000,000,000,000 points"):
        len(design.points)


def test_a_saltelli_design_has_no_more_points_than_others():
    text = '[design]\nkind = "saltelli"\nranges = {quota = [1, 9], uavs = [1, 2]}\nbase = '
    assert plan(text + str(2**14)).count == 5 * 2**14
    with pytest.raises(ValidationError, match="gives 163,840 design points"):
        plan(text + str(2**15))
