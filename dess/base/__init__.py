"""What all else stands on: errors, files, compiled and elementary functions, optional libraries."""
