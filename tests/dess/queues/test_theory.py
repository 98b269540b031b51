"""The closed forms of queues agree with cases by hand, with chains of states, and each other."""

import numpy as np
import pytest

from analysis.verification.closed_forms import Moments
from tests.dess.queues import theory


@pytest.mark.parametrize(("servers", "load"), [(1, 0.9), (2, 1.5), (7, 5.0), (30, 28.0)])
def test_the_probability_of_waiting_is_that_of_the_states(servers: int, load: float) -> None:
    """The stationary probabilities of the birth-death chain, summed from c customers on."""
    n = np.arange(5000)
    log_weights = np.concatenate([[0.0], np.cumsum(np.log(load / np.minimum(n[1:], servers)))])
    weights = np.exp(log_weights - log_weights.max())
    assert theory.erlang_c(servers, load) == pytest.approx(weights[servers:].sum() / weights.sum())


def test_waiting_times_by_hand() -> None:
    # M/M/1 with load 0.8 and service 2: rho / (mu - lambda) = 0.8 / 0.1
    assert theory.waiting_of_mmc(0.4, 2.0, 1) == pytest.approx(8.0)
    exponential = Moments(2.0, 2.0)
    assert theory.waiting_of_mg1(0.4, exponential) == pytest.approx(8.0)
    # M/D/1 waits half as long
    assert theory.waiting_of_mg1(0.4, Moments(2.0, 0.0)) == pytest.approx(4.0)
    # M/M/3 with a = 2, service 1: C / (c mu - lambda) = (4/9) / 1
    assert theory.waiting_of_mmc(2.0, 1.0, 3) == pytest.approx(4 / 9)


def test_losses_by_hand() -> None:
    assert theory.loss_of_mm1k(1.0, 4) == pytest.approx(1 / 5)
    assert theory.loss_of_mm1k(0.5, 2) == pytest.approx(1 / 7)  # 1, 1/2, 1/4
    assert theory.loss_of_mm1k(0.5, 1) == pytest.approx(1 / 3)  # Erlang B of one server


def test_numbers_by_hand() -> None:
    assert theory.number_in_mm1k(1.0, 4) == pytest.approx(2.0)
    assert theory.number_in_mm1k(0.5, 2) == pytest.approx(4 / 7)  # weights 4, 2, 1 of 0, 1, 2
    assert theory.number_in_mm1k(0.5, 200) == pytest.approx(1.0)  # M/M/1: rho / (1 - rho)


def test_the_age_of_an_mm1_queue_is_that_of_the_paper() -> None:
    """Kaul, Yates and Gruteser: with service rate 1 it is smallest at a load of 0.53."""
    assert theory.age_of_mm1(0.5, 1.0) == pytest.approx(3.5)
    loads = np.linspace(0.3, 0.8, 501)
    assert loads[np.argmin([theory.age_of_mm1(load, 1.0) for load in loads])] == pytest.approx(
        0.531, abs=0.002
    )


def test_the_latency_at_a_server_with_fixed_gaps() -> None:
    assert theory.latency_of_slotted_md1(1e-9, 2.0) == pytest.approx(1.0)  # half a gap
    assert theory.latency_of_slotted_md1(0.25, 2.0) == pytest.approx(1.0 + 1.0)  # and M/D/1


def test_the_loss_at_a_server_with_fixed_gaps() -> None:
    # One place: of the arrivals of a gap, one is taken.
    assert theory.loss_of_slotted_md1k(0.5, 1) == pytest.approx(1 - (1 - np.exp(-0.5)) / 0.5)
    assert theory.loss_of_slotted_md1k(0.5, 40) == pytest.approx(0.0, abs=1e-9)
    assert theory.loss_of_slotted_md1k(50.0, 3) == pytest.approx(1 - 1 / 50)
