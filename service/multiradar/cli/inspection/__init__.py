"""`multiradar inspect`: what recordings contain, before they are converted."""
