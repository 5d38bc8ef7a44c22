"""The version of fireworld; recordings and team files hold it."""

__version__ = "0.1.0"
