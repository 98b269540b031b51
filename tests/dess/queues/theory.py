"""Closed forms of queues and of the age of information.

The functions are written from the equations with numpy; they use no code of the simulator.
"""

import numpy as np
from scipy import stats

from dess.analysis.verification.closed_forms import Moments


def erlang_c(servers: int, load: float) -> float:
    """The probability that a customer of an M/M/c queue has to wait (Erlang 1917).

    Args:
        servers: c.
        load: Arrival rate times mean service time (a), below c.
    """
    blocking = 1.0  # Erlang B, by its recursion over the servers
    for count in range(1, servers + 1):
        blocking = load * blocking / (count + load * blocking)
    return servers * blocking / (servers - load * (1 - blocking))


def waiting_of_mmc(arrivals: float, service: float, servers: int) -> float:
    """The mean time that a customer of an M/M/c queue waits for a server.

    Args:
        arrivals: Arrival rate.
        service: Mean service time.
        servers: c.
    """
    return erlang_c(servers, arrivals * service) / (servers / service - arrivals)


def waiting_of_mg1(arrivals: float, service: Moments) -> float:
    """The mean time that a customer of an M/G/1 queue waits (Pollaczek 1930, Khinchine 1932)."""
    second = service.mean**2 + service.deviation**2
    return arrivals * second / (2 * (1 - arrivals * service.mean))


def latency_of_slotted_md1(arrivals: float, gap: float) -> float:
    """The mean time until a server takes a customer, if it takes one at a time at fixed gaps.

    The server looks at its queue at the ends of gaps only, so that a customer waits for half a gap
    and in addition as in an M/D/1 queue (D. Bertsekas, R. Gallager: Data Networks, 1992, section
    3.5, M/G/1 queues with vacations).

    Args:
        arrivals: Arrival rate.
        gap: Time from one customer to the next that the server takes.
    """
    return gap / 2 + waiting_of_mg1(arrivals, Moments(gap, 0.0))


def loss_of_slotted_md1k(load: float, places: int) -> float:
    """The share of the customers that find all K places taken, for such a server.

    It follows from the stationary distribution of the number in the queue after each gap: the
    server takes a customer in each gap at whose end there is one.

    Args:
        load: Arrivals per gap.
        places: K.
    """
    arrived = stats.poisson(load)
    before, after = np.arange(places)[:, None], np.arange(places)
    change = after + 1 - before  # arrivals that fit, if the server takes one
    chain = np.where(change >= 0, arrived.pmf(change), 0.0)
    chain[0, 0] += arrived.pmf(0)  # no customer came, so none was taken
    chain[:, -1] += 1 - chain.sum(1)  # the others did not fit
    values, vectors = np.linalg.eig(chain.T)
    stationary = np.real(vectors[:, np.argmax(np.real(values))])
    empty = stationary[0] / stationary.sum() * arrived.pmf(0)
    return float(1 - (1 - empty) / load)
