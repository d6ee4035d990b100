"""The machine around a program: its files, its memory, its terminal, and how a command ends."""
