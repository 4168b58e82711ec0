//! The benchmarks are in `benches/`: `cargo bench -p contact-benchmarks --bench skips`.
