"""What a UAV observes, as input of a network, and the mask of its allowed actions.

states = compact_states(state, space.chart, guarded=True)
Vector(layout_of(space)).encode(states, missions, uavs)

``states`` has the compact states, from which ``vector``, ``maps`` and ``sets`` encode observations;
``observer`` observes in environments, whose kind ``state`` is that of ``components``.
"""
