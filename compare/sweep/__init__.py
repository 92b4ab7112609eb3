"""Many runs: processes, progress."""
