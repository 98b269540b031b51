"""The page of any study: its sections, sentences, tables and figures."""
