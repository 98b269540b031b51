"""The face: the command line, the notebooks and their rendering."""
