"""From many sessions to the result of a study: one visit's numbers, decisions about them, and what they say together.

Everything here is plain data or a function of it; who computes it, and where, is `daq_app.batch.pool`.
"""
