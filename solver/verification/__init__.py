"""Speed and accuracy of the solver, measured on the present machine, subject by subject, on one page.

A subject is a file with `measure(request)`, a generator of rows: plain data, without drawing or writing.
`measuring.py` lists and runs the subjects, and `daq_app.accuracy_page` shows the rows.
"""
