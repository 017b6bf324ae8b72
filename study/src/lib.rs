//! Variants beside what is published: `halite study` draws sheets of them, `halite tables` builds their tables. The benches
//! are those of the papers' own tables.

pub mod sheets;
pub mod tables;
