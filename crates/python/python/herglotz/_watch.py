"""What is watched during a run: its progress, and a function that may stop it."""

import sys
import time


class Watch:
    """The arguments `progress`, `callback` and `callback_interval`, checked."""

    def __init__(self, progress, callback, callback_interval):
        if not isinstance(progress, bool):
            raise ValueError(f"`progress` is {progress!r}; it must be True or False")
        if callback is not None and not callable(callback):
            raise ValueError(f"`callback` is {callback!r}; it must be a function of the solution so far, which returns True to stop")
        try:
            interval = float(callback_interval)
        except (TypeError, ValueError):
            interval = -1.0
        if not interval >= 0.0:
            raise ValueError(f"`callback_interval` is {callback_interval!r}; it must be a number of seconds, at least 0")
        self.progress, self.callback, self.interval = progress, callback, interval

    def run(self, call, solution=None):
        """The record of a call of the core with the functions that are watched; `solution` makes a solution of a record."""
        if not self.progress and self.callback is None:
            return call(None)
        called = None if self.callback is None else (lambda record: self.callback(solution(record)), self.interval)
        if not self.progress:
            return call((None, called))
        shown = Progress()
        try:
            record = call((shown.update, called))
            if record.interrupted is None and record.success is not False:
                shown.update(1.0)
            return record
        finally:
            shown.close()


NOTHING = Watch(False, None, 1.0)


def watch_of(arguments):
    """Takes the arguments of a watch out of others."""
    return Watch(*(arguments.pop(name) for name in ("progress", "callback", "callback_interval")))


class Progress:
    """A bar of tqdm, where it is installed, which is one of a notebook there; else a line on standard error."""

    def __init__(self):
        self._bar, self._begin = None, time.monotonic()
        try:
            from tqdm.auto import tqdm
        except ImportError:
            return
        self._bar = tqdm(total=100, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def update(self, part):
        percent = 100.0 * min(max(part, 0.0), 1.0)
        if self._bar is not None:
            self._bar.n = round(percent, 1)
            self._bar.refresh()
        elif sys.stderr is not None:
            sys.stderr.write(f"\r{percent:3.0f} % after {time.monotonic() - self._begin:.1f} s")
            sys.stderr.flush()

    def close(self):
        if self._bar is not None:
            self._bar.close()
        elif sys.stderr is not None:
            sys.stderr.write("\n")
