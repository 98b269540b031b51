"""What a UAV observes, as input of a network, and the mask of its allowed actions.

states = compact_states(state, space.chart, guarded=True)
Vector(layout_of(space)).encode(states, missions, uavs)

``guard`` has the return guard, ``states`` the compact states, from which ``vector`` and ``maps``
encode the observations.
"""
