"""State, decisions and texts of the window, without Qt."""
