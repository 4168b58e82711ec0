//! The limits of a text.

/// The maximum length of a text, in bytes, which bounds the memory for its words.
pub const LONGEST_TEXT: usize = 1 << 16;
/// The maximum nesting depth of brackets, signs and powers, so that the recursive parser does not overflow the stack.
pub const DEEPEST_NESTING: usize = 200;
/// The maximum number of nodes of a text, which bounds the memory and the time for its derivatives.
pub const MOST_NODES: usize = 20_000;
