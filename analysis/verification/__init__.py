"""The simulator against what is known: checks of chance and exact ones."""
