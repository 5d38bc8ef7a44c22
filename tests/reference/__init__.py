"""The model in plain numpy: the readable reference of the compiled kernels and the baseline of the benchmarks."""
