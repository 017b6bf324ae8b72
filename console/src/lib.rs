//! The command line of Halite's programs: options become what the library takes, and what it makes is written and reported.

pub mod camera;
pub mod drawn;
pub mod input;
pub mod integral;
pub mod legend;
pub mod look;
pub mod output;
pub mod parse;
pub mod progress;
pub mod request;
pub mod second;
pub mod variant;
