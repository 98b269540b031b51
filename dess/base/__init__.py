"""What all else stands on: errors, files, compiled functions, optional libraries."""
