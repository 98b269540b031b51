"""Trainings: their curves, variants, transfer learning and trained policies."""
