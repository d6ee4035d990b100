"""tools/catalogue"""

from pathlib import Path

from .script import run_script

TOOL = Path(__file__).parents[2] / "tools" / "catalogue"


def test_the_table_of_blocks_is_up_to_date():
    found = run_script(TOOL, "--check")
    assert found.returncode == 0, found.stderr
