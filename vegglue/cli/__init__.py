"""The commands of the shell: each parses its options, calls one verb of `workflow`, and prints what came.

To add a command, write a function `NAME_command` in the file of its group (`ensemble_commands`, `loop_commands`,
`effect_commands`, `twin_commands`), with options from `options.py` where they mean the same, and list it in COMMANDS of
`main.py`. What it does belongs into `workflow`, what it prints as a table into `tables.py`; README lists it.

May import: case, effects, measurements, solver, results, diagnosis, report_page, workflow.
Open first: main.py, ensemble_commands.py.
"""
