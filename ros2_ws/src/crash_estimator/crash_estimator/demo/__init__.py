"""`demo`: a recording replayed, estimated and shown, everything in one command."""
