"""The sea: its nodes and no-fly cells, read from files, and the ways between its cells."""
