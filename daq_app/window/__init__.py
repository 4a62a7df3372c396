"""What the window knows, decides and says, without Qt."""
