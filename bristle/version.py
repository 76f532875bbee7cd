"""The version of the package; its files say which one wrote them."""

__version__ = "0.1.0"
