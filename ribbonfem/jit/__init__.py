"""The compiler: one decorator, its cache, numbers that hold four."""
