"""Integration of sbx into FRobs. The library sbx implements stable-baselines3's algorithms in JAX."""
