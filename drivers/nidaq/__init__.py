"""Six gauge voltages through NI-DAQmx."""
