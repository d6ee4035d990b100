"""Start of the command line."""

import errno
import os


def end_for_memory(error: MemoryError | OSError) -> None:
    """End the process for lack of memory; any other error passes."""
    if isinstance(error, OSError) and error.errno != errno.ENOMEM:
        raise error
    # It is quadvis.machine.failures.MEMORY; there may be too little even to import that.
    os.write(2, b"there is not enough memory; free some, or raise the limit (ulimit -v)\n")
    os._exit(1)


# Ctrl-C may come while the modules below are still being imported.
try:
    import gc

    # The objects made at the start are no garbage; collecting garbage would take a twentieth of the start.
    gc.disable()
    # One BLAS thread: matrices are small here, and a pool of threads costs more than importing numpy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from quadvis.machine.exits import leave, listen
    from quadvis.machine.garbage import uncollected_at_exit

    listen()
    uncollected_at_exit()

    from quadvis import cli
except KeyboardInterrupt:
    os.write(2, b"interrupted\n")
    os._exit(130)
except (MemoryError, OSError) as lack:
    end_for_memory(lack)


def main() -> None:
    """Run the command line, and end the process."""
    try:
        leave(cli.main())
    except MemoryError as lack:  # there was too little even to say so
        end_for_memory(lack)


if __name__ == "__main__":
    main()
