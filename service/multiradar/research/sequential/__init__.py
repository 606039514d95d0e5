"""The filters one measurement at a time, and what theory says of their errors."""
