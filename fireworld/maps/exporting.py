"""Export: stub replaced below."""


def export_city() -> None:
    """Write a city."""
