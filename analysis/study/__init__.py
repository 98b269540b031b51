"""Studies as data: designs, rules for the number of missions, and the shipped studies."""
