"""The sea: where its nodes and no-fly cells are, read from files, and the ways between its cells."""
