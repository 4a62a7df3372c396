"""How fast the solver is and how true: measured on the machine it runs on, subject by subject, on one page.

A subject is a file with `measure(asked, found)`, a generator of rows: plain data, nothing drawn, nothing written.
`subjects.py` lists them, `measuring.py` runs them, `page.py` and `figures/` tell what they found.
"""
