"""The tasks on which quadvis is measured beside other programs; `tools/bench peers` prints the table."""
