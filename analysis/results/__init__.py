"""Results folders: what they hold, how they are read, and how missions are simulated again."""
