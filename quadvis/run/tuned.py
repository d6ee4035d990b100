"""interim"""
def read_tuned(diagram, name, value):
    path, _, p = name.rpartition(".")
    return [(path, p, value)]
