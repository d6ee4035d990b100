"""A checked diagram as the engine takes it: blocks, tasks and wires, in the order of execution."""
