"""Results folders: what they contain, how they are read, and how missions are simulated again."""
