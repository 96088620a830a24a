"""Small mistakes that the tests must notice, and the script that plants them."""
