"""The model of a mission: its state, its rules, and the two engines that run them."""
