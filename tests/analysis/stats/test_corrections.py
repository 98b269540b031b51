"""Corrected p-values, by hand."""

import numpy as np
import pytest

from dess.analysis.stats.corrections import adjust_p_values


def test_adjusted_by_hand():
    p = np.array([0.01, 0.04, 0.03, 0.005])
    # Holm: 0.005 x 4, 0.01 x 3, 0.03 x 2, 0.04 x 1, never falling
    assert adjust_p_values(p, "holm") == pytest.approx([0.03, 0.06, 0.06, 0.02])
    # Benjamini and Hochberg: 0.005 x 4 / 1, 0.01 x 4 / 2, 0.03 x 4 / 3, 0.04
    assert adjust_p_values(p, "fdr") == pytest.approx([0.02, 0.04, 0.04, 0.02])
    assert adjust_p_values(p, None) == pytest.approx(p)
    assert adjust_p_values(np.array([0.4, 0.9]), "holm") == pytest.approx([0.8, 0.9])
    assert adjust_p_values(np.array([0.7, 0.9]), "holm") == pytest.approx([1.0, 1.0])
