"""Many sessions computed: workers, a cluster, derived numbers, sensitivity."""
