"""Settings of all tests."""

from hypothesis import settings

# The same examples in every run, and no time limit for one: the machines that run the tests are shared.
settings.register_profile("quadvis", derandomize=True, deadline=None)
settings.load_profile("quadvis")
