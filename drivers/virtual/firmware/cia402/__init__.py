"""What families of CiA 402 drives share: their seam, gains, notches, terminals, protections."""
