"""The former name of ``dess.envs``, which can be imported for one more release."""

import sys
import warnings

from dess import envs

MESSAGE = "dess.env has become dess.envs"
warnings.warn(MESSAGE, DeprecationWarning, stacklevel=2)
sys.modules[__name__] = envs
