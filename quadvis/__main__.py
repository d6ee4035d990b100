"""Start of the command line."""

import gc
import os

# Nothing of what is made to start a command is garbage; looking for some takes a twentieth of the start.
gc.disable()
# One BLAS thread: matrices are small here, and starting a pool of threads costs more than importing numpy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from quadvis.cli import main  # noqa: E402

if __name__ == "__main__":
    raise SystemExit(main())
