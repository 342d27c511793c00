"""What goes wrong, with the text that the terminal would show: place, value read, remedy."""


class ColdplateError(Exception):
    """Anything that goes wrong inside coldplate."""


class InputError(ColdplateError, ValueError):
    """The input cannot be used as it stands."""


class NumericsError(ColdplateError, ArithmeticError):
    """The numerics failed: no convergence, an open heat balance."""
