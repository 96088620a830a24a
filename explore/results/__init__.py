"""What was computed: the store, its ranking and its index for browsing."""
