"""The former name of ``dess.envs.observations``, which can be imported for one more release."""

import sys
import warnings

from dess.envs import observations

warnings.warn(
    "dess.observations has become dess.envs.observations", DeprecationWarning, stacklevel=2
)
sys.modules[__name__] = observations
