"""`multiradar convert`: vid, ASTERIX and ADS-B."""
