"""The former name of ``dess.envs.integrations``, which can be imported for one more release."""

import sys
import warnings

from dess.envs import integrations

MESSAGE = "dess.integrations has become dess.envs.integrations"
warnings.warn(MESSAGE, DeprecationWarning, stacklevel=2)
sys.modules[__name__] = integrations
