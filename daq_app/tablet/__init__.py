"""The subject's page on a tablet: what serves it, and what the tablet says."""
