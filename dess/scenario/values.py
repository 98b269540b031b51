"""The values of a scenario by field, as files, commands and design points give them."""

from typing import Any

from dess.base.errors import InputError, shown
from dess.physics.section import tuples
from dess.scenario.fields import SECTIONS, ZONE_PADS, is_number

# What all nodes or zones have in common, and what each has in its place: who sets the first means
# all.
_EACH = {
    "arrival_rate": "arrivals.rates",
    "initial_data": "arrivals.initial",
    "failures.pad_rate": "failures.pad_rates",
    "failures.pad_repair": "failures.pad_repairs",
}
# What may be listed for each zone, the start zone first.
_OF_EACH_ZONE = (
    "failures.pad_rates",
    "failures.pad_repairs",
    "data_sheet.pad_mtbf",
    "data_sheet.pad_repair",
)


def merged(base: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Values on top of others; ``failures.uav_rate`` and a table replace parts of a section.

    ``zones.pads`` replaces the pads of the further zones: a number for all, or one for each. A rate
    or an amount for all nodes replaces those of each. A further zone with 0 pads is left out, with
    what is listed for it: its platform is not there.

    Raises:
        InputError: If ``zones.pads`` has another length than ``zones``.
    """
    result: dict[str, Any] = {}
    below = dotted(base)
    above = dotted(values)
    replaced = {pads_of_zones for for_all, pads_of_zones in _EACH.items() if for_all in above}
    if "nodes" in values:  # the names are those of others
        replaced |= {"names", "moved"}
    if "weather.file" in above:
        replaced.add("weather.digest")
    below = {name: value for name, value in below.items() if name not in replaced}
    for name, value in (below | above).items():
        section, _, part = name.partition(".")
        table = None
        if part and section in SECTIONS:
            table = result.setdefault(section, {})
        if isinstance(table, dict):
            table[part] = value
        else:
            result[name] = value
    if ZONE_PADS in result:
        pads = tuples(result.pop(ZONE_PADS))
        zones = result.get("zones") or ()
        pads_of_zones = pads if isinstance(pads, list | tuple) else [pads] * len(zones)
        if not zones or len(pads_of_zones) != len(zones):
            allowed = "with further zones"
            if zones:
                allowed = f"a number, or a list of {len(zones)}"
            raise InputError(ZONE_PADS, f"{shown(pads)} does not fit", allowed)
        result["zones"] = [
            {**zone, "pads": n} for zone, n in zip(zones, pads_of_zones, strict=True)
        ]
    _leave_out_zones_without_pads(result)
    return result


def _leave_out_zones_without_pads(values: dict[str, Any]) -> None:
    """Take the further zones with 0 pads out of the values of a scenario."""
    zones = values.get("zones") or ()
    if not isinstance(zones, list | tuple):
        return
    kept = [number for number, zone in enumerate(zones) if not _has_no_pads(zone)]
    if len(kept) == len(zones):
        return
    values["zones"] = [zones[number] for number in kept]
    for field in _OF_EACH_ZONE:
        section, _, name = field.partition(".")
        of_section = values.get(section, {})
        of_zones = of_section.get(name)
        if isinstance(of_zones, list | tuple) and len(of_zones) == 1 + len(zones):
            first, *others = of_zones
            of_section[name] = [first, *(others[number] for number in kept)]


def _has_no_pads(zone: Any) -> bool:
    """Whether a further zone is a table with 0 pads."""
    pads = zone.get("pads") if isinstance(zone, dict) else None
    return isinstance(pads, int) and is_number(pads) and pads == 0


def dotted(values: dict[str, Any]) -> dict[str, Any]:
    """Values by field: the table of a section becomes fields such as ``failures.uav_rate``."""
    fields: dict[str, Any] = {}
    for name, value in values.items():
        if name in (*SECTIONS, "zones") and isinstance(value, dict):
            fields |= {f"{name}.{part}": of_part for part, of_part in value.items()}
        else:
            fields[name] = value
    return fields
