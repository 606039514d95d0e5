"""Encounters: prediction of the proximity of aircraft, its time and its distance."""
