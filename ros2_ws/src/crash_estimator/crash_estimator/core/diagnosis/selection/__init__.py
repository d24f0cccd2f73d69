"""Model selection: candidates, score screening, fits, acceptance, forward selection, pairs, pruning."""
