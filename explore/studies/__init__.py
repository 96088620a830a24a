"""What is asked: study files, the request that follows from one, and its designs."""
