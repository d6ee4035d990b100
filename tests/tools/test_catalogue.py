"""tools/catalogue"""

import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[2] / "tools" / "catalogue"


def test_the_table_of_blocks_is_up_to_date():
    found = subprocess.run([sys.executable, TOOL, "--check"], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
