"""The policies that are part of dess: one table of what is known of each of them.

A new policy gets a row here; the trained ones have their descriptions in their own folders.
"""

from typing import NamedTuple


class Shipped(NamedTuple):
    """What is known of a policy.

    Attributes:
        seconds: The time of a decision [s], as measured on one core.
        module: The module of its class; empty for a trained policy.
        kind: The name of its class.
        about: What it does, in words.
        look: Its number among the colours and markers of figures, so that it looks the same in all
            of them; None if it takes one that is free.
        is_null: Whether claims about learning are tried on it, since it has learned nothing.
        reference: Its rank among the slow policies that others are compared with; 0 if it is none.
    """

    seconds: float
    module: str = ""
    kind: str = ""
    about: str = ""
    look: int | None = None
    is_null: bool = False
    reference: int = 0


_HEURISTICS = "dess.policies.heuristics"
_PLANNER = "dess.policies.planner"

HEURISTICS = {
    "random": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="Random",
        about="a random safe move, clear of teammates",
        look=0,
        is_null=True,
    ),
    "random-unguarded": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="RandomUnguarded",
        about="the same without the return guard: it shows what the guard is worth",
        look=8,
        is_null=True,
    ),
    "nearest": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="Nearest",
        about="the nearest node with enough data",
        look=1,
    ),
    "greedy": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="Greedy",
        about="the best residual data for the distance",
        look=2,
        is_null=True,
    ),
    "tour": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="Tour",
        about="a fixed circuit through the nodes, split among the UAVs",
        look=3,
    ),
    "age": Shipped(
        seconds=2e-6,
        module=_HEURISTICS,
        kind="Age",
        about="the stalest data for the distance",
        look=7,
    ),
}
PLANNERS = {
    "planner": Shipped(
        seconds=4e-4,
        module=_PLANNER,
        kind="Planner",
        about="a plan for the whole team, kept up to date",
        look=9,
        reference=1,
    ),
    "planner-short": Shipped(
        seconds=7e-5,
        module=_PLANNER,
        kind="ShortPlanner",
        about="the same with a fifth of the search",
        reference=3,
    ),
    "planner-long": Shipped(
        seconds=3e-3,
        module=_PLANNER,
        kind="LongPlanner",
        about="the same with a longer search",
        look=6,
        reference=2,
    ),
}
TRAINED = {
    "generalist": Shipped(seconds=1e-5),
    "ddqn": Shipped(seconds=6e-6, look=4),
    "ddqn-2": Shipped(seconds=6e-6),
    "ddqn-3": Shipped(seconds=6e-6),
    "ddqn-paper": Shipped(seconds=7e-5, look=5),
}
SHIPPED = HEURISTICS | PLANNERS | TRAINED

# Those that look the same in all figures, in the order of their colours and markers.
WITH_LOOK = tuple(
    sorted(
        (name for name, policy in SHIPPED.items() if policy.look is not None),
        key=lambda name: SHIPPED[name].look or 0,
    )
)
# Those that have learned nothing, by name.
NULLS = tuple(sorted(name for name, policy in SHIPPED.items() if policy.is_null))
# The slow ones that others are compared with, the first of them that there is.
REFERENCES = tuple(
    sorted(
        (name for name, policy in SHIPPED.items() if policy.reference),
        key=lambda name: SHIPPED[name].reference,
    )
)
