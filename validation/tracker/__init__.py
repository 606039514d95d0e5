"""The tracker: association, scenarios, unseen recordings, health, heights, late plots."""
