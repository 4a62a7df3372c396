"""What `daq-app accuracy` found, as a page with pictures and as tables in the docs."""
