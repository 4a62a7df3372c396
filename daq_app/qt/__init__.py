"""The window in Qt: it shows the views of `daq_app.window.view` and returns people's acts, but decides nothing."""
