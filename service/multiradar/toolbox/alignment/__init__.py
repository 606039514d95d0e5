"""Registration of radars: what `align` computes."""
