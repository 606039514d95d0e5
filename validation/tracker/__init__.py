"""The tracker: association, scenes, unseen recordings, health, heights, late plots."""
