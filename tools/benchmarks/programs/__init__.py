"""One module for each program that does the tasks.

A module has ``load()``, which imports what the program needs and returns its version, and ``build(task)``,
which makes the model and returns a function ``prepare(steps)``. That gives a function ``run()`` of no
argument, which runs so many steps from the start and returns the values that `Task.expected` knows. Only
``run()`` is timed. ``MOST``, if a module has it, is the largest number of blocks that are tried.
"""
