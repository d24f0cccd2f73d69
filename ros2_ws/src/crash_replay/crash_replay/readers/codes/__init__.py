"""What the codes of crash test databases stand for: the tables (`*_library`), and what is made of them."""
