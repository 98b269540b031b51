"""The return guard: which actions let a UAV still reach the charging zone in time.

    mask = guard(view)                                   # (R, 5), at least one action per row
    actions = np.where(mask, values, -np.inf).argmax(1)

A UAV that cannot fill its quota with its present battery must be able to reach a free cell of the
charging zone, with a margin of some slots for detours around teammates. The rules are described in
``docs/concepts/return-guard.md``. The modules of this package have compiled functions on the arrays
of one mission; ``chart`` is a ``dess.physics.chart.Chart``, ``reach`` the table that
``dess.model.ways_home.reach_of`` makes.
"""

from dess.model.guard.moves import guard as guard
