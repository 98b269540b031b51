"""What a policy is, and what it sees."""

from typing import Protocol, runtime_checkable

import numpy as np

from dess.view import View

__all__ = ["Policy", "View"]


@runtime_checkable
class Policy(Protocol):
    """Decides for a batch of UAVs at once and remembers nothing between calls.

    Attributes:
        name: The name that results carry.
    """

    name: str

    def act(self, view: View) -> np.ndarray:
        """Choose an action for every row of the view.

        Args:
            view: What the R UAVs that must act may know, in however many missions.

        Returns:
            (R,) integers: 0 north, 1 east, 2 south, 3 west, 4 hover.
        """
        ...
