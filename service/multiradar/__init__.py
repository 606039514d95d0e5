"""ATC multiradar processing: aircraft tracks and radar biases estimated jointly."""
