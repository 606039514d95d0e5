"""How functions are compiled, where compiled code is kept, and how it is compiled beforehand."""
