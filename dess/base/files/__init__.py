"""The door for files: all that is read, written or listed of users and of results goes through it.

``reading`` and ``writing`` have the functions for all files, for text in TOML and JSON, for zip
files and for folders in use. ``documents`` reads JSON as models, and ``tables`` parquet.

Only regular files are read, and up to a limit: a pipe, a device or a file without end in the place
of an input would block the program or fill the memory. Only new and regular files are written, each
completely or not at all. Everything else is refused in one line with its path.
"""
