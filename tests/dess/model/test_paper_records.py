"""Whatever is built beyond the paper: where it is off, the records are those of before."""

from hashlib import sha256

from dess import policies
from dess.model.batch import simulate_batch
from dess.scenario.scenario import load_scenario
from tests.pins.test_records import bytes_of

# Of the records of the commit before scenarios had sections (issue 18).
BEFORE = "f3c1634a34e33836a3d63a14af7134091e2631ebccac9b9c5179f732d5ab18de"


def test_without_sections_the_records_of_the_paper_stay_the_same_to_the_bit():
    records = simulate_batch(load_scenario("paper"), policies.load("greedy"), 2022, 200)
    assert len(records.operations) == 0
    content = bytes_of(records.missions) + bytes_of(records.uavs)
    assert sha256(content).hexdigest() == BEFORE
