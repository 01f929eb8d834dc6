#!/usr/bin/env bash
# The quick cells of one group of the stability matrix (matrix.h); `make stability` draws all.
export PELT_LIBDIR=$PELT_BUILD/lib/pelt
exec "$PELT_BUILD/tests/stability/matrix" --quick --group filter
