"""The machine around a program: files, memory, terminal, signals, and the end of a command."""
