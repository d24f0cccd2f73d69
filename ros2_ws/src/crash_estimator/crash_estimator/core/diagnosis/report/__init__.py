"""The answer: verdict, ranking, steps, text, and the model with the effects that were found."""
