"""Plain NumPy twins that judge the compiled loops; nothing of the program imports them."""
