"""The measures of the scorecard, one module each."""
