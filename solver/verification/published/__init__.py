"""Published problems of one deformable body, solved by the same code as the finger."""
