"""Wheels for other machines need a processor with vector instructions; where it has none, the import says so instead of ending the interpreter."""

import numpy as np

# What distinguishes the level x86-64-v3, by the names of numpy.
_NEEDED = ("AVX2", "FMA3")


def _features():
    core = getattr(np, "_core", None) or np.core
    return getattr(core._multiarray_umath, "__cpu_features__", {})


def check(features):
    """Refuses a wheel for other machines where the processor lacks its instructions; what was built here has those of the processor."""
    lacks = [name for name in _NEEDED if not features.get(name, True)]
    if not lacks:
        return
    from importlib import metadata

    if "manylinux" in (metadata.distribution("herglotz").read_text("WHEEL") or ""):
        raise ImportError(
            f"this wheel is for processors of the level x86-64-v3, and this one has no {' and no '.join(lacks)}; "
            "build the package here: pip install --no-binary herglotz herglotz"
        )


check(_features())
