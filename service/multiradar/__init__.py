"""Air traffic control multiradar processing: aircraft tracks and radar biases, estimated jointly."""
