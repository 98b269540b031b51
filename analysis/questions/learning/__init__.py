"""Questions about training: learning curves, ablations, the trained policies in a folder."""
