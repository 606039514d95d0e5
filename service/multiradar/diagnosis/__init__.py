"""What is probably wrong with a sensor, its settings or its data, when measurements are lost."""
