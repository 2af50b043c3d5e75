"""How loops are compiled: cached, and without the lock that would keep threads from running side by side."""

from numba import njit

# Products and sums may fuse. No flag that lets one compilation round otherwise than the next: the same numbers from a
# cold and a warm cache.
compiled = njit(cache=True, nogil=True, fastmath={"contract", "nsz"}, error_model="numpy")
# For eliminations, whose order of operations is part of the result.
compiled_exactly = njit(cache=True, nogil=True, error_model="numpy")
