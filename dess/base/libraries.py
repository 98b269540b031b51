"""Optional libraries: which extra installs each, and one line that says so where it is absent.

In a clone of the repository, since no package index has ``dess``:

    pip install .               the simulator, all policies, evaluations, studies and sweeps
    pip install '.[learning]'   trainings
    pip install '.[reports]'    figures, pages, and studies of sensitivities
    pip install '.[geo]'        shipping lanes, buffers and circles of own seas, geofences of plans
    pip install '.[all]'        everything
    pip install '.[examples]'   the libraries of the examples, as far as they fit together

With ``-c constraints.txt``, the versions are those of the tests. An optional library is imported
where it is used. The command line turns an import that fails into the line of ``absence``; who
would find out only after long work asks ``needs`` first.
"""

from importlib.util import find_spec

from dess.base.errors import InputError

# The extras, by the names under which their libraries are imported.
EXTRAS = {
    "learning": ("torch",),
    "reports": (
        *("matplotlib", "PIL", "seaborn", "SALib", "ipykernel", "IPython", "jinja2"),
        *("jupyter_client", "jupytext", "markupsafe", "nbclient", "nbconvert", "nbformat"),
        *("packaging", "pygments"),
    ),
    "geo": ("shapely",),
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
    return next((_missing_library(what, library, extra) for library in absent), None)


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
            return _missing_library(what, library, extra)
    return None


def _missing_library(what: str, library: str, extra: str) -> MissingLibraryError:
    title = _TITLES.get(library, library)
    command = f"pip install '.[{extra}]' -c constraints.txt"
    problem = f"needs {title}, which is not installed; in a clone of the repository: {command}"
    return MissingLibraryError("", f"{what} {problem}")
