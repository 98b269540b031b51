"""What an answer assumes, as facts for the one who pays."""

from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.answers.settings.ranking import rank_settings
from dess.analysis.facts import Fact
from dess.analysis.metrics import PRODUCT
from dess.analysis.names import value_text
from dess.analysis.results.tables import Results
from dess.analysis.sheet import battery_sentence, type_sentences
from dess.physics.fleet import IN_UNITS
from dess.scenario.data_sheet import LORA, DataSheet, lora
from dess.scenario.quantities import printed
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.weather import ALWAYS, DAYLIGHT

_LISTED = "what the file of the nodes says"


def assumption_facts(results: Results, metric: str = PRODUCT) -> list[Fact]:
    """What a success, a slot and a cell are, who flies, and the data, radio, wind and failures.

    Args:
        results: A study of a scenario with a data sheet. Where its design varies a field, the fact
            says so.
        metric: The metric that ranks its settings, where it does not search for a fleet.
    """
    space = results.scenario()
    units = results.scenario().units
    assert units
    sheet = space.data_sheet
    nodes = numbers.format_count(len(space.nodes), "node")
    varied = {f.removeprefix("data_sheet.") for f in results.store.manifest.values[0]}
    wide, high = (printed(cells * units.cell, "m") for cells in space.size)
    quota = ""
    if space.quota != 0:
        quota = " with its quota filled"

    def given(field: str, otherwise: str) -> str:
        """A field of the sheet in words."""
        if field in varied:
            return "as asked"
        value = getattr(sheet, field)
        if not value:
            return otherwise
        if isinstance(value, str):
            return value
        return "a list of them"

    duty_cycle = given("duty_cycle", "")
    duty = ""
    if duty_cycle:
        duty = f", for {duty_cycle} of the time on average, bursts left out"
    repair = given("repair", "")
    if repair:
        end = f"is repaired in {repair}"
    else:
        end = "is lost for good"
    failures = f"a UAV fails every {given('mtbf', '')} of flying on average, and {end}"
    flight = "window" if space.weather.is_on else "mission"
    facts = {
        "success": f"at the end of a {flight} every UAV has landed{quota}",
        "slot": f"{slot_in_words(space, varied)}; once a slot every UAV moves by a cell, hovers or "
        "charges",
        "cell": cell_in_words(space, varied),
        "sea": f"{wide} x {high}",
        "policy": f"{_policy_of(results, metric)}, which knows the data left at every node",
        "altitude": f"{value_text(space.altitude)} m",
        "charging": f"from empty to full in {given('charging', '')}",
        "reserve": given("reserve", "none"),
        "data": f"{given('data_rate', _LISTED)} at each of {nodes} in messages of "
        f"{given('message', sheet.assumed.get('message', ''))}",
        "data at the start": data_at_the_start(space, varied),
        "radio": f"SNR {given('snr', 'of a link budget')}, path loss exponent "
        f"{value_text(space.path_loss_exponent)}, range {given('range', 'without end')}; "
        f"{given('bandwidth', '')}, {_rates_of(space, varied)}{duty}",
        **_weather_of(space, given("wind", "none")),
        "battery": _battery_of(space, varied),
        **_types_of(space, varied),
        "failures": failures if sheet.mtbf or "mtbf" in varied else "none",
    }
    if space.weather.is_on:
        del facts["battery"]  # the window says it
        facts["means"] = "over years, with 95 % intervals"
    else:
        facts["mission"] = given("horizon", printed(space.max_slots * units.slot, "s"))
        facts["means"] = "over random missions, with 95 % intervals"
    return [Fact(label, value) for label, value in facts.items()]


def slot_in_words(space: ScenarioSpace, varied: set[str]) -> str:
    """How long a slot is, and what it follows from."""
    sheet, units = space.data_sheet, space.units
    assert units
    if "cruise" in varied:
        return "the time in which a UAV crosses a cell at its cruising speed"
    if sheet.cell or "cell" in varied:
        return f"{printed(units.slot, 's')}, in which a UAV crosses a cell at {sheet.cruise}"
    endurance = "as asked" if "endurance" in varied else sheet.endurance
    return f"{printed(units.slot, 's')}, a hundredth of the endurance of {endurance}"


def cell_in_words(space: ScenarioSpace, varied: set[str]) -> str:
    """How wide a cell is, and what it follows from."""
    sheet, units = space.data_sheet, space.units
    assert units
    if "cell" in varied:
        return "as wide as asked"
    if sheet.cell:
        return f"{printed(units.cell, 'm')} wide at any cruising speed"
    return f"{printed(units.cell, 'm')} wide, the way of a slot at {sheet.cruise}"


def data_at_the_start(space: ScenarioSpace, varied: set[str]) -> str:
    """Which data nodes have when a mission begins, and how old they are.

    Args:
        space: A scenario.
        varied: The fields of the sheet that its design varies.
    """
    sheet, units = space.data_sheet, space.units
    assert units
    backlog = ""
    if "backlog" in varied:
        backlog = "as asked"
    elif isinstance(sheet.backlog, str):
        backlog = sheet.backlog
    elif space.arrivals.initial:
        backlog = _LISTED
    if space.weather.is_on:
        first = backlog or "none, of age 0"
        return f"{first} at the beginning of a year; a window has those left before it, and newer"
    if "idle" in varied:
        return "those of an idle time as asked"
    if sheet.idle:
        more = f"{backlog}, and " if backlog else ""
        return f"{more}those of {sheet.idle} without a mission, which is their age"
    initial = f"{backlog or 'none'}, of age 0, as if UAVs had just emptied all nodes"
    hours = 24 - space.max_slots * units.slot / 3600
    if hours < 1:
        return initial
    return (
        f"{initial}; a service of once a day finds the data of {hours:.3g} h more, which are up to "
        f"{hours:.3g} h old (idle)"
    )


def _weather_of(space: ScenarioSpace, wind: str) -> dict[str, str]:
    """The wind of missions, or the weather of years and when UAVs fly in it."""
    weather = space.weather
    if not weather.is_on:
        return {"wind": f"{wind}, the same everywhere and always"}
    limits = [f"{name} {value}" for name, value in weather.limits.items()]
    speed = space.data_sheet.max_speed
    known = {ALWAYS: "round the clock", DAYLIGHT: "by daylight"}
    operating = known.get(weather.operating) or f"{weather.operating}, solar time"
    wind = f"of the hour, from {weather.height} to the altitude by a power law (0.11); UAVs "
    wind += f"fly if {speed} through the air are enough for all moves"
    if weather.calm:
        wind = "none: UAVs fly as in still air in all hours whose wind is known"
    return {
        "weather": f"hour by hour, {weather.path.name}; the same everywhere in the sea",
        "wind": wind,
        "operating": f"{operating}; limits: {', '.join(limits) or 'none but the wind'}",
        "window": f"open hours in a row, at most {weather.longest}, whose weather policy and "
        "return guard know beforehand; each move takes the most that it takes in one of its hours",
        "lost UAVs": _replaced(space),
    }


def _replaced(space: ScenarioSpace) -> str:
    """What takes the place of a lost UAV in a year."""
    sheet = space.data_sheet
    after = f"a new one comes after {printed(sheet.delivery_ms / 1000, 's')}"
    if not sheet.spares:
        return after
    return f"{numbers.format_count(sheet.spares, 'spare')}, with none left {after}"


def _battery_of(space: ScenarioSpace, varied: set[str]) -> str:
    """What a slot takes of the battery."""
    if varied & {"wind", "cruise", "endurance", "hover", "tip_speed", "induced_speed"}:
        return "what a slot takes follows from the speed through the air"
    return battery_sentence(space)


def _types_of(space: ScenarioSpace, varied: set[str]) -> dict[str, str]:
    """What follows for each type of UAVs, unless the types vary."""
    if varied & {*IN_UNITS, "wind", "hover", "reserve", "tip_speed", "induced_speed", "fleet"}:
        return {}
    named = (sentence.partition(": ") for sentence in type_sentences(space))
    return {label: sentence for label, _, sentence in named}


def _rates_of(space: ScenarioSpace, varied: set[str]) -> str:
    """The rates of a radio in words."""
    sheet = space.data_sheet
    if varied & {"modulation", "rates", "max_rate"}:
        return "rates as asked"
    if sheet.rates:
        slowest, fastest = sheet.rates[0], sheet.rates[-1]
        if slowest == fastest:
            return f"{slowest[1]} from {slowest[0]} on"
        return f"{slowest[1]} from {slowest[0]} on to {fastest[1]} from {fastest[0]} on"
    if sheet.modulation == LORA and not varied & {"bandwidth", "packet"}:
        return _lora_rates_of(sheet)
    if sheet.modulation == LORA:
        return "the rates of LoRa"
    return f"at most {sheet.max_rate or sheet.assumed['max_rate']}"


def _lora_rates_of(sheet: DataSheet) -> str:
    """The rates of LoRa in words: what of its packets takes time besides the data."""
    if sheet.packet:
        return (
            f"the rates of LoRa in packets of {sheet.packet}, their preambles and headers counted"
        )
    bandwidth = sheet.number("bandwidth")
    fast = f"{lora.lorawan_overhead(7, bandwidth):.2f} times as long with spreading factor 7"
    slow = f"{lora.lorawan_overhead(12, bandwidth):.2f} times with 12"
    overhead = f"with which a full LoRaWAN packet takes {fast} and {slow}"
    return f"the rates of LoRa without preambles and headers, {overhead}"


def _policy_of(results: Results, metric: str) -> str:
    """The policy of the answer: of the cheapest fleet, or of the best setting."""
    if requirements_of(results):
        return search_of(results).best.policy
    return str(rank_settings(results, metric)["policy"].iloc[0])
