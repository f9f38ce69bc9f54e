"""Soft tissue: laws from recordings, organs of spheres, contacts for haptic loops.

    import tpmkit
    fit = tpmkit.fit("recording.csv")     # the simplest law that the recording supports
    fit.parameters                        # a DataFrame: estimates, intervals, verdicts
    fit.plot()

Everything is SI: arguments, columns and attributes carry their unit in the name. What goes wrong is a
`tpmkit.Error` whose text is one line, "WHERE: WHAT; expected ..."; of an argument it is a ValueError too
(`tpmkit.ArgumentError`). Long calls release the interpreter's lock; Ctrl-C ends them.

The package calls the library of the program `tpm`. What a docstring says so of runs in another process: figures
drawn by `Fit.save`; folders of recordings, `validate`, `design` and `view`, by the program itself.
"""

from ._core import ArgumentError, Error, Protocol, __version__, share_dir
from ._contact import Contact, run_session
from ._data import example, open, read_recording
from ._fit import Fit, Specimens, fit
from ._judge import Design, Validation, design, validate, view
from ._law import Element, Law
from ._run import Plan, plan, simulate, sweep

__all__ = [
    "ArgumentError",
    "Contact",
    "Design",
    "Element",
    "Error",
    "Fit",
    "Law",
    "Plan",
    "Protocol",
    "Specimens",
    "Validation",
    "design",
    "example",
    "fit",
    "open",
    "plan",
    "read_recording",
    "run_session",
    "share_dir",
    "simulate",
    "sweep",
    "validate",
    "view",
    "__version__",
]
