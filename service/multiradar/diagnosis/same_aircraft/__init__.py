"""Heights and identities that sensors report for the same aircraft."""
