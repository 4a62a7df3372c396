"""The results of `daq-app accuracy`, as a page with pictures and as tables in the docs."""
