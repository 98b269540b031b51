"""Settings of the fields of scenarios: plain ones, odd ones, and some of no field."""

from hypothesis import strategies as st

from dess.scenario.fields import SECTIONS, fields_of
from dess.scenario.scenario import ScenarioSpace
from tests.fuzz.strategies.values import texts, toml_values

FIELDS = (*fields_of(ScenarioSpace), *SECTIONS)
# Plain settings of sections, single fields and whole tables.
PLAIN = (
    "age.measured=true",
    "age={measured=true, reward=-0.1}",
    'arrivals.process="continuous"',
    'arrivals={process="continuous", buffer=2, service="newest", schedule=[[3, 2.0], [9, 0.0]]}',
    "charging.measured=true",
    'charging={order="lowest-battery", power=7, plan_waits=true}',
    "failures.node_rate=0.2",
    'failures={uav_rate=0.02, uav_repair=5, uav_data="lost", node_rate=0.1, node_data="lost"}',
    "failures={pad_rate=0.3, pad_repair=2}",
    "wind={strength=0.7, direction=225, gusts=0.3, seed=9}",
    "fleet=[{slots_per_cell=2, rate=0.5}, {flying_time=60, quota=9}]",
    'data_sheet={endurance="35 min", cruise="15 m/s", charging="40 min"}',
    'fleet=[{endurance="20 min", charging="25 min", price=9000}, {cruise="5 m/s"}]',
    'data_sheet={wind="4 m/s from SW", max_speed="20 m/s"}',
    'data_sheet={bandwidth="125 kHz", snr="12 dB at 2 km", range="2 km", mtbf="100 h"}',
    'data_sheet.data_rate="3 MB/h"',
    "data_sheet.data_rate=20 kB/h",
    "data_sheet.backlog=[1 MB, 2 MB, 0 MB]",
    "data_sheet.modulation=lora",
    "data_sheet.rates=[[-7.5 dB, 5.5 kbit/s], [0 dB, 50 kbit/s]]",
    "data_sheet.duty_cycle=1 %",
    "data_sheet.altitude=120 m",
    "data_sheet.message=100 B",
    "radio={steps=[[-20, 0.002], [3, 1.5]], duty_cycle=0.5}",
    "arrivals={message=0.003}",
    "landing=true",
    "quota=0",  # which needs landing
)
# Values at the ends of what sections allow, and past them.
_ENDS = st.sampled_from(
    ["0", "1", "0.0", "1.0", "-1e-9", "1.0000001", "0.5", "64", "65", "6400", "6401", "1e6"]
    + ["360.1", "true", '"lost"', '"kept"', '"newest"', '"continuous"', '"lowest-battery"']
    + ["[[1, 2]]", "[[0, 1], [0, 2]]", "[[1.5, 1]]", "[0.1, 0.1, 0.1]", '"storm.csv"', "[{}]"]
    + ['"/dev/zero"', "{}", "{measured=true}", "[{slots_per_cell=0}]", "[{a=1}]"]
    + ["[{slots_per_cell=100000}]", '"0 km"', '"1e300 h"', '"-3 MB"', '"5 m/s from nowhere"']
    + ['"12 dB at 0 m"', "3,5 MB/h", "54 kmph", "[1 kB, 2 kB]"]
    + ['[["0 dB", "1 bit/s"], ["0 dB", "2 bit/s"]]', '[["0 dB"]]', "[[0, 1], [1, 1]]", '"fsk"']
)
_names = st.sampled_from(FIELDS) | st.sampled_from(SECTIONS).flatmap(
    lambda section: texts.map(lambda name: f"{section}.{name}")
)
odd_settings = st.tuples(_names, _ENDS | toml_values).map("=".join)

# Numbers at the ends of what a computer can hold, and the forms in which a field may take them.
_ODD = ("-0.0", "5e-324", "-5e-324", "1e-308", "1e308", "-1e308", "inf", "-inf", "nan", "1e19")
_FORMS = ("{}", "[{}, {}]", "[{}, {}, {}]", "[[0, {}]]", "[[{}, 1]]", "[[0, 0.0], [5, {}]]")
_RATES = ("arrival_rate", "arrivals.rates", "arrivals.schedule")  # of which compiled loops are made
_numbers = st.sampled_from(_ODD) | st.just("-0.0")
_forms = st.sampled_from(_FORMS) | st.just("{}")
odd_numbers = st.tuples(
    st.sampled_from(FIELDS) | st.sampled_from(_RATES),
    st.tuples(_forms, _numbers).map(lambda drawn: drawn[0].replace("{}", drawn[1])),
).map("=".join)
