"""Who may do what: callers, their credentials and roles."""
