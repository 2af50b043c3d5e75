"""The one layer of words: templates that turn values into sentences for the terminal, the page and Python.

A finding is a frozen dataclass; `sentence(value)` renders it by the macro of the same name in `templates/`, so a class
`ParameterFarFromPrior` needs a macro `parameter_far_from_prior(v)`; `page_sentence(value)` renders it as HTML. Pages
stand in `page/`, files that a user is given in `files/`, ends of error messages in `remedies`. Logic never reads a
sentence. Rendered examples stand in `tests/wording/`; no other test pins wording.

May import: no other folder.
Open first: sentences.py, numbers.py.
"""
