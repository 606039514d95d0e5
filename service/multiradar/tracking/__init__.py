"""From measurements to tracks: identity, lifecycle, one aircraft's step."""
