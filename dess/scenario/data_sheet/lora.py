"""The rates of LoRa by its spreading factor, and what a packet adds (Semtech, SX1276/77/78/79)."""

import math
from fractions import Fraction

# The least SNR [dB] at which LoRa receives a spreading factor, the slowest first (Semtech, data
# sheet of SX1276/77/78/79); the bandwidths [Hz] that it has, and its usual coding rate; the symbols
# [s] from which on its low data rate optimisation leaves out two bits of each.
LEAST_SNR = {12: -20.0, 11: -17.5, 10: -15.0, 9: -12.5, 8: -10.0, 7: -7.5}
BANDWIDTHS = (7.8e3, 1.625e6)
_CODING = Fraction(4, 5)
_LONG_SYMBOL = 0.016
_PREAMBLE = 8 + 4.25  # symbols
# The header that LoRaWAN adds to a packet, and the most that a packet of its European band has
# beside it, by spreading factor [bytes] (LoRaWAN 1.0.4; RP002, EU863-870).
_LORAWAN_HEADER = 13
_LORAWAN_MOST = {12: 51, 11: 51, 10: 51, 9: 115, 8: 222, 7: 222}


def make_steps(bandwidth: float, size: int) -> tuple[tuple[float, float], ...]:
    """From which SNR on a spreading factor has which spectral efficiency.

    Args:
        bandwidth: The bandwidth [Hz].
        size: The size of a packet [bytes], or 0 for the symbols alone.

    Returns:
        For each spreading factor, the slowest first, the SNR [dB] and the efficiency [bit/s/Hz].
    """
    return tuple(
        (snr, rate_of(factor, bandwidth, size) / bandwidth) for factor, snr in LEAST_SNR.items()
    )


def rate_of(factor: int, bandwidth: float, size: int = 0) -> float:
    """The rate of a spreading factor [bit/s].

    Args:
        factor: The spreading factor.
        bandwidth: The bandwidth [Hz].
        size: The size of a packet [bytes], or 0 for the symbols alone.
    """
    symbol = (1 << factor) / bandwidth
    bits = factor
    if symbol >= _LONG_SYMBOL:
        bits -= 2
    if not size:
        return float(bits * _CODING) / symbol
    # Semtech, data sheet of SX1276/77/78/79, 4.1.1.7: with an explicit header and a checksum.
    blocks = max(math.ceil((8 * size - 4 * factor + 28 + 16) / (4 * bits)), 0)
    symbols = _PREAMBLE + 8 + blocks * 4 / _CODING
    return 8 * size / (float(symbols) * symbol)


def lorawan_overhead(factor: int, bandwidth: float) -> float:
    """How many times as long as its data a full LoRaWAN packet takes with all that is sent."""
    most = _LORAWAN_MOST[factor]
    sent = most + _LORAWAN_HEADER
    rates = rate_of(factor, bandwidth) / rate_of(factor, bandwidth, sent)
    return rates * sent / most
