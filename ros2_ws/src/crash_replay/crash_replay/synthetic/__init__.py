"""Simulated crash tests whose truth is known; they share no formula with the estimators."""
