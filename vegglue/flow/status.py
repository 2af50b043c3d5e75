"""How a member was solved: a number in every ensemble, and in words.

A member that found no steady state has failed: it is counted, says why, and weighs nothing.
"""

import numpy as np

NOT_YET, SOLVED_BY_NEWTON, SOLVED_BY_MARCHING, FAILED, RUN_BY_COMMAND = -1, 0, 1, 2, 3
STATUS_WORDS = {
    SOLVED_BY_NEWTON: "solved by Newton's method",
    SOLVED_BY_MARCHING: "solved by marching in time",
    FAILED: "failed",
    RUN_BY_COMMAND: "run by the command",
}


def members_with(status: np.ndarray, number: int) -> int:
    """How many members (m,) ended that way."""
    return int(np.count_nonzero(status == number))
