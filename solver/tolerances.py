"""Tolerances of round-off, each by what it is relative to."""

ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
CUT = 1e-9  # part of a motion of the body as a whole below which what is held does not move with it [-]
FORCE_MET = 1e-9  # relative difference within which a searched state has the normal force given
IMAGINARY = 1e-30  # step of a complex derivative: its square is nothing [-]
NO_ENERGY = 1e-14  # part of an energy that is left out of its quadratic form [-]
SED_STILL = 1e-10  # relative change of the ending's SED in a step from which on a slide at finite strain has settled
SHALLOW = 1e-6  # least indentation [mm]: below, round-off is as large as what there is to find
FEEBLE = 1e-12  # least friction that is not none [-, MPa]: below, round-off is as large as the drag
STIFFNESSES = 1e10  # largest ratio of two tissues' stiffnesses: beyond, round-off swallows the softer one
UNHELD = 1e14  # stiffness by its inverse, largest numbers, from which a body is taken to move freely [-]
UNMET = 1e-9  # part of the friction limit by which a given drag may be missed
