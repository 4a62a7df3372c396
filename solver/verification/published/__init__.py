"""Published problems that one deformable body allows, run through the very same code as the finger."""
