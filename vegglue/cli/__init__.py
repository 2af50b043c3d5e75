"""The commands of the shell: each parses its options, calls one verb of `workflow`, and prints what came.

To add a command, write a function `NAME_command` in `commands.py`, with options from `terminal.py` where they mean the
same, and list it in COMMANDS of `main.py`. What it does belongs into `workflow`; what it prints into `printed.py` and,
for `--json`, `objects.py`. The table of `docs/commands.md` lists it.

Help and a refused config come at once, since files of commands import nothing heavy at their top: verbs are called as
`vegglue.NAME`, which imports them then, and all else that needs numpy is imported in the function that needs it.
`tests/cli/test_startup.py` holds that.

May import: case, diagnosis, effects, flow, inference, measurements, pages, results, wording, workflow.
Open first: main.py, commands.py.
"""
