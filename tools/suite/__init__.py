"""What is known about the tests themselves: what they take, and which of them a busy computer makes fail."""
