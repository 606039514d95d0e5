"""`multiradar convert`: VID, ASTERIX and ADS-B."""
