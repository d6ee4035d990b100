"""Start of the command line."""

# Ctrl-C may come while the modules below are still being imported.
try:
    import gc
    import os

    # The objects made at the start are no garbage; collecting garbage would take a twentieth of the start.
    gc.disable()
    # One BLAS thread: matrices are small here, and a pool of threads costs more than importing numpy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from quadvis.machine.exits import listen
    from quadvis.machine.garbage import uncollected_at_exit

    listen()
    uncollected_at_exit()

    from quadvis.cli import main
except KeyboardInterrupt:
    import os

    os.write(2, b"interrupted\n")
    os._exit(130)
except MemoryError:
    import os

    # It is quadvis.machine.failures.MEMORY; there may be too little even to import that.

    os.write(2, b"there is not enough memory; free some, or raise the limit (ulimit -v)\n")
    os._exit(1)

if __name__ == "__main__":
    raise SystemExit(main())
