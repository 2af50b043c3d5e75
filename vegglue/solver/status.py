"""How a member was solved: a number in every ensemble."""

NOT_YET, SOLVED_BY_NEWTON, SOLVED_BY_MARCHING, FAILED = -1, 0, 1, 2
