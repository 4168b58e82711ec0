//! Tests of pieces, splittings and generating functions.
