"""The scorecard for readers and programs: tables, plots, figures."""
