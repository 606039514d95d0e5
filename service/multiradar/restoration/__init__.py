"""How one aircraft flew: what can be told of its path from the plots of some time."""
