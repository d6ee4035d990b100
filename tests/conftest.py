"""Settings of all tests."""

import signal

from hypothesis import settings

# Whoever starts the tests in the background of a script leaves Ctrl-C ignored, and programs inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no time limit for one: the machines that run the tests are shared.
settings.register_profile("quadvis", derandomize=True, deadline=None)
settings.load_profile("quadvis")
