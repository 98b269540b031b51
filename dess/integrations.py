"""The former name of ``dess.envs.integrations``, which can be imported for one more release."""

import sys
import warnings

from dess.envs import integrations

warnings.warn(
    "dess.integrations has become dess.envs.integrations", DeprecationWarning, stacklevel=2
)
sys.modules[__name__] = integrations
