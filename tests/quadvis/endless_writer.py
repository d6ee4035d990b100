"""Leaves records in a mailbox as fast as it can: python endless_writer.py FILE ROOM COUNT.

All numbers of a record are the stamp, so a reader sees whether they belong together.
"""

import mmap
import sys

from quadvis.machine.mailbox import Mailbox


def main() -> None:
    path, room, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    with open(path, "r+b") as file:
        words = mmap.mmap(file.fileno(), 0)
        box = Mailbox(words, room, count)
        found = box.newest()
        stamp = found.stamp if found is not None else 0
        while True:
            stamp += 1
            box.put(stamp.to_bytes(8, "little") * (room // 8), stamp)


if __name__ == "__main__":
    main()
