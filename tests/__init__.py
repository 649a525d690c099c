"""The laws: each test's name is a proposition, and each law has a twin that must fail."""
