//! q
#![allow(dead_code, unused)]
mod common;
mod dense_output;
mod gauss;
