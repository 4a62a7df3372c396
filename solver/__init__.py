"""From a scene to a prediction: arrays in, arrays out, no files."""
