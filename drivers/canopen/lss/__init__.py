"""Layer setting services (CiA 305): set node numbers and bit rates of nodes without them."""
