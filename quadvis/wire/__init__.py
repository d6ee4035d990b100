"""How a host and a target talk: keys, levels, verbs, messages, sockets. It knows no diagram and no run.

zmq and msgpack are imported by the modules that use them, which nobody imports before there is a host or a
target.
"""
