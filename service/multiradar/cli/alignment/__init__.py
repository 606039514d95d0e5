"""`multiradar align`: biases of radars from recordings, with their residuals."""
