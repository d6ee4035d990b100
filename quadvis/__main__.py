"""Start of the command line."""

# Ctrl-C may come while the modules below are still being imported.
try:
    import atexit
    import gc
    import os

    # The objects made at the start are no garbage; collecting garbage would take a twentieth of the start.
    gc.disable()
    # At its end Python would look for garbage among all objects twice; the system takes the memory anyway.
    atexit.register(gc.freeze)
    # One BLAS thread: matrices are small here, and a pool of threads costs more than importing numpy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from quadvis.machine.exits import listen

    listen()

    from quadvis.cli import main
except KeyboardInterrupt:
    import os

    os.write(2, b"interrupted\n")
    os._exit(130)

if __name__ == "__main__":
    raise SystemExit(main())
