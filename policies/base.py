"""The policy protocol: a name and ``act``, which chooses actions for many UAVs at once.

class Hover:
    name = "hover"

    def act(self, view: View) -> np.ndarray:
        return np.full(len(view), 4)
"""

from typing import Protocol, runtime_checkable

import numpy as np

from dess.view import View

__all__ = ["Policy", "View"]


@runtime_checkable
class Policy(Protocol):
    """A policy chooses actions for many UAVs at once, and keeps no state between calls.

    A slow policy may have the attribute ``chunk``: how many missions a study computes and stores
    together at most, so that an interruption loses little.

    Attributes:
        name: The name under which results are stored.
    """

    name: str

    def act(self, view: View) -> np.ndarray:
        """Choose an action for every row of the view.

        Args:
            view: The state of the R UAVs that must act, over any number of missions.

        Returns:
            (R,) integers: 0 north, 1 east, 2 south, 3 west, 4 hover.
        """
        ...
