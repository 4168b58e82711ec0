//! The benchmarks are in `benches/`; one of them is run by `cargo bench -p contact-benchmarks --bench skips`.
