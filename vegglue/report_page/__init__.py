"""The page about a run: its words, tables and figures.

The headline stands in `answer_words.py`; places, instruments and fields in `cause_words.py` and `cause_pictures.py`;
listed effects in `diagnosis_words.py`; the posterior in `findings.py`, `posterior_words.py` and their like.

May import: effects, case, site, measurements, flow, solver, results, screening, inference, figures.
Open first: page.py, answer_words.py, cause_words.py, findings.py.
"""
