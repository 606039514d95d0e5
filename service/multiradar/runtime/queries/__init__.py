"""What readers may ask of live tracks: forecasts, encounters, windows of measurements."""
