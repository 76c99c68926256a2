"""Layer setting services (CiA 305): node numbers and bit rates of nodes that have none yet."""
