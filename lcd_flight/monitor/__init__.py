"""What is seen of a flight while it goes on, in a process of its own, out of the stream that it publishes."""
