"""What the networks see of a state: kinds of observations."""
