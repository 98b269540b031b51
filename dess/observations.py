"""The former name of ``dess.envs.observations``, which can be imported for one more release."""

import sys
import warnings

from dess.envs import observations

MESSAGE = "dess.observations has become dess.envs.observations"
warnings.warn(MESSAGE, DeprecationWarning, stacklevel=2)
sys.modules[__name__] = observations
