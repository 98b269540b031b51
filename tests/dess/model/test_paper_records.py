"""Whatever is built beyond the paper: where it is off, the records are those of before."""

from hashlib import sha256

from dess import policies
from dess.model.batch import simulate_batch
from dess.scenario.scenario import load_scenario
from tests.pins.test_records import bytes_of

# Before scenarios had sections the records were these, but for the last bits of exp and log.
BEFORE = "584f79ab49a0dcc021db6b385b7eb51d300cb4ee54fb46c24715cb1afc300404"


def test_without_sections_the_records_of_the_paper_stay_the_same_to_the_bit():
    records = simulate_batch(load_scenario("paper"), policies.load("greedy"), 2022, 200)
    assert len(records.operations) == 0
    content = bytes_of(records.missions) + bytes_of(records.uavs)
    assert sha256(content).hexdigest() == BEFORE
