"""Questions about the operation of a fleet: charging pads, the age of the data, failures."""
