"""Forces along a motion and their derivatives: the law of a link, driven motion, linearisation."""
