"""Start of the command line."""

import os

# One BLAS thread: the matrices here are small, and starting a pool of threads costs more than the import of numpy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from quadvis.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
