"""The command line: thin. Parse, call, print. Nothing heavy is imported before it is needed."""

import os

# Our matrix products are small: a second BLAS thread gains nothing, and waits for the first by spinning, which on busy
# cores makes planning ten times slower and takes time from the flight loop. Read by numpy when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
