"""Optional libraries: which extra installs each, and one line that says so where it is absent.

    pip install dess               the simulator, all policies, evaluations, studies and sweeps
    pip install 'dess[learning]'   trainings
    pip install 'dess[reports]'    figures, pages, and studies of sensitivities
    pip install 'dess[geo]'        shipping lanes and buffers of seas from GeoJSON files
    pip install 'dess[units]'      data sheets of scenarios
    pip install 'dess[all]'        everything
    pip install 'dess[examples]'   the libraries of the examples, as far as they fit together

An optional library is imported where it is used. The command line turns an import that fails into
the line of ``absence``; who would find out only after long work asks ``needs`` first.
"""

from importlib.util import find_spec

from dess.errors import InputError

# The extras, by the names under which their libraries are imported.
EXTRAS = {
    "learning": ("torch",),
    "reports": (
        *("matplotlib", "PIL", "seaborn", "SALib", "IPython", "jinja2", "jupytext"),
        *("markupsafe", "nbconvert", "nbformat", "packaging", "pygments", "traitlets"),
    ),
    "geo": ("shapely",),
    "units": ("pint",),
    "distributed": ("distributed",),
    "tensorboard": ("tensorboard",),
    "examples": ("sb3_contrib", "stable_baselines3", "supersuit", "torchrl"),
}
_TITLES = {"torch": "PyTorch", "PIL": "Pillow", "tensorboard": "TensorBoard"}


class MissingLibraryError(InputError):
    """An optional library is not installed: one line with the command that installs it."""


def missing(extra: str, what: str) -> MissingLibraryError | None:
    """The error that a library of an extra is not installed, if one is not; nothing is imported.

    Args:
        extra: The extra.
        what: What needs it, for the message.
    """
    absent = (library for library in EXTRAS[extra] if find_spec(library) is None)
    return next((MissingLibraryError(_line(what, library, extra)) for library in absent), None)


def needs(extra: str, what: str) -> None:
    """Raise the error of ``missing``, if there is one.

    Raises:
        MissingLibraryError: If a library of the extra is not installed.
    """
    if error := missing(extra, what):
        raise error


def absence(error: ModuleNotFoundError, what: str) -> MissingLibraryError | None:
    """The error in the words of ``needs``, if the module that was not found is an optional one."""
    library = (error.name or "").partition(".")[0]
    for extra, libraries in EXTRAS.items():
        if library in libraries:
            return MissingLibraryError(_line(what, library, extra))
    return None


def _line(what: str, library: str, extra: str) -> str:
    title = _TITLES.get(library, library)
    return f"{what} needs {title}, which is not installed: pip install 'dess[{extra}]'"
