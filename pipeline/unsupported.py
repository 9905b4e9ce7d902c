"""What ends a comparison before it starts."""


class UnsupportedError(Exception):
    """The scene holds something that has no counterpart in the engine."""
