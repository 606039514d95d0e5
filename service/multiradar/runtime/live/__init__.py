"""The live pipeline: intake, writer of the journal, processor, publication."""
