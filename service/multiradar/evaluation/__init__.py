"""The scorecard: tracks against what is known of the aircraft, by measures the field agrees on."""
