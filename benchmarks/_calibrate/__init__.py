"""What the values of the decision rule trade, from trials stored once and decided often."""
