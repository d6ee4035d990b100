"""Settings of all tests."""

import gc
import os
import signal
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings

from quadvis.machine.processes import ONE_THREAD
from tests.stages import longest_first, share

# As in the workers of a sweep: before numpy is imported, and for the commands under test.
os.environ.update(ONE_THREAD)

# Whoever starts the tests in the background of a script leaves Ctrl-C ignored, and programs inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup leaves it ignored, and so would all commands under test

# Machine code is compiled once for all tests, and for all processes that run some of them.
os.environ.setdefault("QUADVIS_CACHE", str(Path(__file__).parents[1] / ".pytest_cache" / "machine_code"))

# The same examples in every run, and no time limit for one: the machines that run the tests are shared.
# The second stage tries more of them: `-m "slow or hypothesis" --hypothesis-profile thorough`.
settings.register_profile("thorough", derandomize=True, deadline=None)
settings.register_profile("quick", settings.get_profile("thorough"), max_examples=20)
# A search with other examples in each run, for some minutes a test: see tests/faults/README.md.
settings.register_profile("long", deadline=None, max_examples=20_000)
settings.load_profile("quick")


# Packages that a user may leave out; what needs one of them has its name in the name of the test.
OPTIONAL = [name for name in ("mujoco",) if find_spec(name) is None]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a gate try one share of the tests that are chosen."""
    words = "try only one share of the tests, such as the second of five, 2/5; see tests/README.md"
    parser.addoption("--share", metavar="K/N", default="1/1", help=words)


@pytest.hookimpl(trylast=True)  # after pytest has brought together what shares a fixture
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out other shares, skip what needs a missing package, and begin with what takes longest."""
    items[:], others = share(items, config.getoption("--share"))
    config.hook.pytest_deselected(items=others)
    for item in items:
        for name in OPTIONAL:
            if name in item.nodeid:
                item.add_marker(pytest.mark.skip(reason=f"the package {name} is not installed"))
    longest_first(items)


def pytest_collection_finish() -> None:
    """Keep the garbage collector from looking through thousands of tests again and again."""
    gc.collect()
    gc.freeze()
