"""The window: Qt shows what `daq_app.window.view` derives and hands back what people do. Nothing here decides."""
