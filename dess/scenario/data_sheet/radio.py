"""The radio of a data sheet: its SNR, its range, and the rates that follow from the SNR."""

import math
from typing import Any

from dess.base.elementary import log10
from dess.base.errors import InputError, shown
from dess.scenario.data_sheet import lora
from dess.scenario.data_sheet.power import Power
from dess.scenario.data_sheet.quantities import LORA, STEP, as_listed
from dess.scenario.quantities import measured, printed

LINK_BUDGET = ("tx_power", "noise_figure", "frequency")


class Radio(Power):
    """The radio of the nodes and the UAVs of a data sheet."""

    def radio_fields(self) -> dict[str, Any]:
        """The altitude, the SNR at a distance, the range and the rates."""
        if self.snr:
            snr, anchor = measured(self.snr, "dB at m")
        else:  # Friis' equation, and thermal noise at 290 K
            anchor = self.number("free_space")
            loss = 20 * log10(4 * math.pi * anchor * self.number("frequency") / 299_792_458)
            noise = 10 * log10(1.380649e-20 * 290 * self.number("bandwidth"))
            snr = self.number("tx_power") - loss - noise - self.number("noise_figure")
        reach = self.number("range")
        cell = self.units.cell
        if self.range and reach < cell:
            size = printed(cell, "m")
            problem = f"is less than a cell of {size}, the way of a slot at {self.cruise}"
            self.refuse("range", problem, f"{size} or more")
        altitude = self.number("altitude")
        if self.range and reach <= altitude:
            height = printed(altitude, "m")
            self.refuse("range", f"ends above the sea, {height} below", f"above {height}")
        steps = self._steps()
        max_rate = 0.0
        if not steps:
            max_rate = self.number("max_rate")
        return {
            "altitude": altitude,
            "edge_snr": snr,
            "radio.anchor": anchor,
            "radio.range": reach,
            "radio.max_rate": max_rate,
            "radio.steps": steps,
            "radio.duty_cycle": self.number("duty_cycle", 100.0) / 100,
        }

    def _steps(self) -> tuple[tuple[float, float], ...]:
        """From which SNR [dB] on the spectral efficiency is which [bit/s/Hz]; none for shannon."""
        for name, other in (("modulation", "rates"), ("max_rate", "rates")):
            if getattr(self, name) and getattr(self, other):
                raise InputError(name, f"is given beside {other}", "one of both")
        if self.modulation == LORA:
            return self._lora_steps()
        if self.packet:
            self.refuse("packet", "is of lora", 'modulation = "lora", or no packet')
        bandwidth = self.number("bandwidth")
        steps: list[tuple[float, float]] = []
        for pair in self.rates or ():
            numbers = [
                measured(text, units)[0] for text, (units, _) in zip(pair, STEP, strict=True)
            ]
            snr, efficiency = numbers[0], numbers[1] / bandwidth
            if steps and not (snr > steps[-1][0] and efficiency > steps[-1][1]):
                before = (self.rates or ())[len(steps) - 1]
                problem = f"{shown(as_listed(pair))} comes after {shown(as_listed(before))}"
                raise InputError("rates", problem, "pairs whose SNR and rate rise")
            steps.append((snr, efficiency))
        return tuple(steps)

    def _lora_steps(self) -> tuple[tuple[float, float], ...]:
        """The steps of LoRa's spreading factors."""
        if self.max_rate:
            raise InputError("max_rate", "is given beside lora, which has rates", "one of both")
        bandwidth = self.number("bandwidth")
        least, most = lora.BANDWIDTHS
        if not least <= bandwidth <= most:
            self.refuse("bandwidth", "is none of lora", "7.8 kHz..1.625 MHz")
        size = self.number("packet") / 8
        if not size.is_integer():
            self.refuse("packet", "is no whole number of bytes", "1 B to 255 B")
        return lora.make_steps(bandwidth, int(size))
