"""Corrections of p-values, worked by hand."""

import numpy as np
import pandas as pd
import pytest

from analysis.stats.correction import adjust, for_choice


def test_adjusted_by_hand():
    p = np.array([0.01, 0.04, 0.03, 0.005])
    # Holm: 0.005 x 4, 0.01 x 3, 0.03 x 2, 0.04 x 1, never falling
    assert adjust(p, "holm") == pytest.approx([0.03, 0.06, 0.06, 0.02])
    # Benjamini and Hochberg: 0.005 x 4 / 1, 0.01 x 4 / 2, 0.03 x 4 / 3, 0.04
    assert adjust(p, "fdr") == pytest.approx([0.02, 0.04, 0.04, 0.02])
    assert adjust(p, None) == pytest.approx(p)
    assert adjust(np.array([0.4, 0.9]), "holm") == pytest.approx([0.8, 0.9])
    assert adjust(np.array([0.7, 0.9]), "holm") == pytest.approx([1.0, 1.0])


def test_a_chosen_baseline_multiplies_p_values_by_the_number_of_candidates():
    table = pd.DataFrame({"p_adjusted": [0.01, 0.4]})
    assert for_choice(table, 3)["p_adjusted"].tolist() == pytest.approx([0.03, 1.0])
