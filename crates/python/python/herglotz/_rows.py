"""The rows of a motion as tables and pictures."""

import numpy as np


class Rows:
    """What all results with rows at times `t` have; each names its columns and its arrays."""

    def _columns(self):
        """The columns by name, without t: arrays of shape (k,)."""
        raise NotImplementedError

    def _arrays(self):
        """The arrays with the names of their axes, the coordinates of the axes, and what else is known of the motion."""
        raise NotImplementedError

    def _plotted(self):
        """The names of the columns that are plotted where none is named."""
        raise NotImplementedError

    def __getitem__(self, name):
        """A column by name, of shape (k,); the names are those of `to_pandas`, and ``"t"``."""
        if name == "t":
            return self.t
        columns = self._columns()
        if name not in columns:
            known = [*columns]
            few = ", ".join(known[:12]) + (", ..." if len(known) > 12 else "")
            raise KeyError(f"there is no column {name!r}; the columns are {few}")
        return columns[name]

    def to_pandas(self):
        """The rows as a `pandas.DataFrame` with index t."""
        import pandas

        return pandas.DataFrame(self._columns(), index=pandas.Index(self.t, name="t"))

    def to_xarray(self):
        """The rows as an `xarray.Dataset` with an axis for time, and axes for the components."""
        import xarray

        data, axes, attributes = self._arrays()
        return xarray.Dataset(data, {"t": self.t} | axes, attributes)

    def plot(self, *names, ax=None):
        """Plots columns against time with matplotlib: those named, or the main ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_of(ax)
        for name in names or self._plotted():
            ax.plot(self.t, self[name], label=name)
        ax.set_xlabel("t")
        ax.legend()
        return ax


def axes_of(ax):
    """The axes to plot on."""
    import matplotlib.pyplot

    return matplotlib.pyplot.gca() if ax is None else ax


def times_after(asked, end, t):
    """The times of a motion that is continued from its end: to `t`, or by default to those of `asked` that were not reached."""
    asked = np.atleast_1d(np.asarray(asked, dtype=float))
    start = asked[0] if len(asked) > 1 else 0.0
    if t is None:
        t = asked[asked > end] if asked[-1] > start else asked[asked < end]
        if len(t) == 0:
            raise ValueError("the motion has reached its end: give a later `t`")
    times = np.array(t, dtype=float, ndmin=1)
    return times if len(times) and times[0] == end else np.concatenate([[end], times])
