"""The page of any study: its sections, its sentences and tables, its drawings."""
