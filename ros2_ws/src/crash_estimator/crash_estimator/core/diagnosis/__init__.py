"""Which physical effect is missing (`diagnose`), and where a model fails."""
