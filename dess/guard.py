"""The former name of ``dess.model.guard``, which can be imported for one more release."""

import sys
import warnings

from dess.model import guard

MESSAGE = "dess.guard has become dess.model.guard"
warnings.warn(MESSAGE, DeprecationWarning, stacklevel=2)
sys.modules[__name__] = guard
