"""Speed of the engines; run by the nox session bench."""
