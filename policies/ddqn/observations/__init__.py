"""The kinds of observations: how a state is encoded as the input of a network."""
