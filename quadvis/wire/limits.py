"""The limits of the wire. Whatever exceeds one is refused and counted, before it takes memory."""

VERSION = 1

MESSAGE = 4 << 20  # bytes of one message to a host
REQUEST = 1 << 19  # bytes of one message to a target, which has to hold what strangers send
PIECE = 1 << 18  # bytes of a file in one message
ITEMS = 1 << 16  # values in one message, those in lists and maps included
DEPTH = 12  # lists and maps inside one another
TEXT = 1 << 16  # bytes of one text, except a drawing in a reply
NAME = 200  # characters of a name

CONNECTIONS = 16  # with a key, at each of the two sockets
HALF_OPEN = 64  # TCP connections at each socket that have not shown a key yet
HANDSHAKE = 2.0  # s until a connection must have shown a key
HANDSHAKES = 8  # connections of one key within that time
RATE = 1000  # requests per second and key
BURST = 2000  # requests at once, after a quiet time
ITEMS_A_REQUEST = 256  # a longer request counts as one more for each so many values
PENDING = 64  # requests of one key that are answered later, at once
LONGEST_DEADLINE = 600.0  # s

QUEUED = 2  # messages that libzmq holds for one connection
LAG = 1 << 20  # bytes beyond them that wait for one connection; older stream data is dropped
OUTGOING = 8 << 20  # bytes of stream data that other threads have published and nobody has sent yet
SUBSCRIPTIONS = 64  # topics of one connection

HEARTBEAT = 1.0  # s between signs of life of a connection
DEAD_AFTER = 5.0  # s without one
RENEWAL = 0.2  # s between renewals of the lease
LEASE = 1.0  # s without one: the lease is lost

PORTER_MEMORY = 256 << 20  # bytes that the porter may take for all its peers
PORTER_LIFE = 0.25  # s between its signs of life
PORTER_SILENT = 5.0  # s without one: it hangs, and is ended
PORTER_START = 30.0  # s that it has for the first one

PORT = 22222  # control; the next port introduces the target, the one after it has the streams
