"""Questions about training: learning curves, ablations, and the trained policies in a folder."""
