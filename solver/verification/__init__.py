"""Speed and accuracy of the solver, measured on the present machine, subject by subject, on one page.

A subject is a file with `measure(request, measurements)`, a generator of rows: plain data, nothing drawn or written.
`subjects.py` lists the subjects, `measuring.py` runs them, and `daq_app.accuracy_page` shows the rows.
"""
