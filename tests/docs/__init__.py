"""Laws of the documentation site."""
