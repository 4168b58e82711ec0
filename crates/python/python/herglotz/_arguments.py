"""The arguments of functions whose arguments other functions take."""

import inspect


class Arguments:
    """The arguments of a function by name, with its default values for those that are not given.

    `inspect.Signature.bind` takes as long as a short motion; here it only says what is wrong with a call.
    """

    def __init__(self, function):
        self._signature = inspect.signature(function)
        parameters = self._signature.parameters.values()
        self._positional = [x.name for x in parameters if x.kind is x.POSITIONAL_OR_KEYWORD]
        self._defaults = {x.name: x.default for x in parameters}
        self.names = tuple(self._defaults)

    def bind(self, given, named):
        """The arguments of a call, as a dict.

        Raises
        ------
        TypeError
            For arguments that the function does not take.
        """
        found = self._defaults | dict(zip(self._positional, given)) | named
        is_known = len(found) == len(self._defaults) and len(given) <= len(self._positional)
        is_once = not any(name in named for name in self._positional[: len(given)])
        is_whole = not any(value is inspect.Parameter.empty for value in found.values())
        if not (is_known and is_once and is_whole):
            self._signature.bind(*given, **named)
        return found
